"""The lines that the plot of the paper's figure draws."""

from benchmarks.paper_figures import line_of


def test_a_line_goes_from_left_to_right_in_whatever_order_its_sizes_were_measured():
    rows = [{"pipeline": "ours", "centers": count, "size": size, "mean": 0.1 * size} for size in (5, 2, 10, 3) for count in (500, 1000)]
    assert line_of(rows, "ours", 500, "mean") == [(size, 0.1 * size) for size in (2, 3, 5, 10)]
