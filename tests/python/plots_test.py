import numpy as np
import pytest

import raylign


def test_a_notebook_shows_the_verdict_and_pictures(spine):
    pytest.importorskip("matplotlib").use("Agg")
    result = raylign.register(spine.volume, spine.views, spine.start)
    page = result._repr_html_()
    assert "registered" in page and "data:image/png;base64," in page
    figure = result.plot()
    assert len(figure.axes) == 3 and figure.axes[0].get_title().startswith("AP")
    # The red edges lie where the X-ray's are: at the pose, not at the start.
    edges = np.nan_to_num(figure.axes[0].images[1].get_array().filled(0))
    down, right = np.gradient(spine.views[0].image)
    assert np.corrcoef(edges.ravel(), np.hypot(down, right).ravel())[0, 1] > 0.7
