"""Variants of the ablation change what they are named after, and nothing twice."""

from benchmarks.ablation import DEFAULT, variants


def test_every_variant_is_another_one() -> None:
    default, *others = variants()
    assert default.config == DEFAULT and not default.is_told
    changed = [(repr(one.config), one.is_told) for one in [default, *others]]
    assert len(set(changed)) == len(changed)
    assert len({one.name for one in [default, *others]}) == len(changed)
