"""Vertex animation textures for game engines, as OpenVAT and its shaders for Unity, Unreal and Godot define them."""
