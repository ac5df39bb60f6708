"""The recipes of docs/extend change few files; tests/docs/test_blocks.py follows them."""

from tests.guides import list_blocks, read_page


def list_changed(page: str) -> list[str]:
    """Files that the diffs of a recipe change, in order."""
    blocks = list_blocks(read_page(f"extend/{page}.md"))
    return [block.text.split()[1] for block in blocks if block.language == "diff"]


def test_a_feature_is_an_entry_in_one_file():
    """Of a node, an edge and a query edge alike."""
    assert list_changed("feature") == ["datamodules/feature_config.py"]


def test_a_column_that_networks_read_takes_its_declaration_and_a_feature():
    """Whoever counts it aside, which the first part of the recipe shows."""
    names = list_changed("column_of_the_memory")
    assert names[:2] == ["sgm/schema.py", "sgm/memory/memory_batch.py"]
    assert names[2:] == ["sgm/schema.py", "datamodules/feature_config.py"]
