"""A team of another whose last joint slides."""

from __future__ import annotations

from dataclasses import replace

from coop_drake.tree.component_tree import ComponentTree


def with_sliding_joint(tree: ComponentTree) -> ComponentTree:
    """The same tree but for its last joint, which slides along its x axis, from -0.1 m to 0.1 m."""
    last = tree.joints[-1]
    slider = replace(last, kind="prismatic", axis=(1.0, 0.0), lower=-0.1, upper=0.1)
    components = [replace(c, joint=slider) if c.joint == last else c for c in tree.components]
    return replace(tree, components=tuple(components))
