"""Run docs/notebook.ipynb and keep what it shows: `python tools/make_notebook.py`.

The tests call `run`; the documentation shows the outputs that are stored in the file.
"""

from pathlib import Path

import nbformat
from nbclient import NotebookClient

PATH = Path(__file__).parents[1] / "docs/notebook.ipynb"


def run(path: Path = PATH) -> nbformat.NotebookNode:
    """The notebook after a run of all its cells in a kernel of their own."""
    book = nbformat.read(path, as_version=4)
    folder = {"metadata": {"path": str(PATH.parent)}}
    NotebookClient(book, timeout=120, kernel_name="python3", resources=folder).execute()
    return book


def main() -> None:
    """Write the notebook with its outputs, without times and widgets' states."""
    book = run()
    book.metadata.pop("widgets", None)
    book.metadata["language_info"] = {"name": "python"}
    for cell in book.cells:
        cell.metadata.pop("execution", None)
    nbformat.write(book, PATH)


if __name__ == "__main__":
    main()
