"""One file a figure: ``compute(results)`` gives its datasets, ``draw(results)`` the picture."""
