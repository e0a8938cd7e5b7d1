"""Sphinx's configuration: `./run docs` writes these pages to build/docs."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

from wgmb import __version__

project = "wgmb"
author = "The wgmb authors"
copyright = "2026, the wgmb authors"
version = release = __version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "api", "mathml", "self_contained"]
exclude_patterns = ["extensions"]
language = "en"

nb_execution_mode = "off"  # tools/make_notebook.py runs the notebook, and so do the tests
nb_ipywidgets_js = {}  # the sliders are not on the page
myst_enable_extensions = ["attrs_block", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

default_role = "code"  # docstrings write names in single backticks
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
autodoc_default_options = {"members": True}
add_module_names = False
maximum_signature_line_length = 88
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = f"wgmb {version}"
html_static_path = ["static"]
html_favicon = "static/favicon.svg"
html_extra_path = ["../build/page/page.html"]  # made by tools/page/make_page.py
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"navigation_with_keys": True}
pygments_style = "friendly"
pygments_dark_style = "monokai"
