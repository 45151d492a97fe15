"""Sphinx configuration: `make docs` builds the pages of this folder into build/docs without a network connection."""

import sys
from importlib.metadata import version as distribution_version
from pathlib import Path

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS / "_extensions"))

project = "creepkit"
author = "the authors of creepkit"
copyright = "the authors of creepkit, Apache-2.0"
version = release = distribution_version("creepkit")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx_gallery.gen_gallery",
    "law_pages",
    "reference_pages",
    "docstrings",
    "gallery_sources",
    "study_reports",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_extensions"]
templates_path: list[str] = []

html_theme = "furo"
html_title = "creepkit"
html_extra_path = ["../build/site"]
html_theme_options = {"navigation_with_keys": True}

myst_enable_extensions = ["deflist"]
myst_heading_anchors = 3
# Reports of studies, from a page in a folder of docs/: report:FOLDER/FILE without its suffix.
myst_url_schemes = {"http": None, "https": None, "mailto": None, "report": {"url": "../reports/{{path}}.html"}}
# Options of commands keep their two hyphens.
smartquotes = False

# Signatures keep the annotations of the source; nothing is evaluated, so no type has to be imported.
autodoc_typehints = "signature"
autodoc_type_aliases = {name: name for name in ("ArrayLike", "Bools", "Floats", "Ints")}
python_maximum_signature_line_length = 100
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "ignore-module-all": True}
# Annotations name types without their modules, and two modules may have an alias of the same name.
suppress_warnings = ["ref.python"]
python_use_unqualified_type_names = True
toc_object_entries = False

# Examples are rendered, not executed: the tests execute them, and some take minutes.
sphinx_gallery_conf = {
    "examples_dirs": "../build/gallery",
    "gallery_dirs": "gallery",
    "plot_gallery": "False",
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_memory": False,
    "min_reported_time": 1e9,
    "remove_config_comments": True,
    "backreferences_dir": None,
}
