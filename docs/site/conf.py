"""The site of the Markdown files, where they are: `scripts/site` builds it."""

import importlib.metadata
import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
VERSION = tomllib.loads((ROOT / "Cargo.toml").read_text())["workspace"]["package"]["version"]

project = "hlcp"
release = VERSION
extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc"]
include_patterns = ["*.md", "docs/**.md", "docs/site/*.rst", "python/README.md", "crates/*/README.md"]
root_doc = "README"
myst_heading_anchors = 4
suppress_warnings = ["myst.header"]  # a page may begin at any level

# The Python package as it is in its folder: the compiled part has no documentation.
sys.path.insert(0, str(ROOT / "python"))
importlib.metadata.version = lambda _: VERSION
autodoc_mock_imports = ["hlcp._hlcp"]
autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints = "none"
numpydoc_show_class_members = False
default_role = "py:obj"

html_theme = "furo"
html_title = "hlcp"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False

CONTENTS = """

```{toctree}
:hidden:

Guide <docs/guide>
Methods <docs/methods>
Results <docs/results>
Gallery <docs/scenes>
Python <python/README>
```

```{toctree}
:hidden:
:caption: Background

docs/theory
docs/verification
docs/performance
docs/machines
```

```{toctree}
:hidden:
:caption: Reference
:glob:

docs/site/rust
docs/site/python
crates/*/README
```

```{toctree}
:hidden:
:caption: Logs
:glob:

docs/results/*
```

```{toctree}
:hidden:
:caption: Development

ARCHITECTURE
CONTRIBUTING
CHANGELOG
RELEASE
SECURITY
CODE_OF_CONDUCT
```
"""


def prepare(app, name, source):
    """Gives the front page the table of contents, which the Markdown file has in its text; leaves
    a link to a folder, which a site does not show, as its text."""
    folder = Path(app.env.doc2path(name)).parent
    plain = lambda link: link[1] if (folder / link[2]).is_dir() else link[0]
    source[0] = re.sub(r"\[([^\]]*)\]\(([^)#]+)\)", plain, source[0])
    if name == root_doc:
        source[0] += CONTENTS


def setup(app):
    app.connect("source-read", prepare)
