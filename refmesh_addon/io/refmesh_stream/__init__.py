"""The compressed export: .refmesh files."""
