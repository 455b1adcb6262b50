"""Finds the object, the robots and the grasps in the model directives of a scenario."""

import re
from dataclasses import dataclass

from pydrake.common.schema import Transform
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import AddWeld, ModelDirective, PackageMap

from coop_drake.errors import ScenarioError
from coop_drake.scenario.directives import checked_directives, flat, package_map
from coop_drake.scenario.model import Scenario

_LONGEST = 80
_LETTERS = "letters, digits, blanks and _ . : + -, with a letter, digit or _ in front"
_NAME = re.compile(rf"\w[\w.:+ -]{{0,{_LONGEST - 1}}}")
"""Names of models: pictures of a robot bear its name, so that it must be part of a file's name, too."""


@dataclass(frozen=True)
class RobotAssembly:
    """One robot: one model, or several that are welded together.

    Attributes:
        name: Name of the model that the base belongs to; also the robot's name.
        models: Names of its models, in the order of the directives.
        object_frame: Scoped name of the frame on the object where the grasp's weld begins.
        gripper_frame: Scoped name of the frame on the robot where it ends.
        key: Key of the robot's model in the scenario file.
    """

    name: str
    models: tuple[str, ...]
    object_frame: str
    gripper_frame: str
    key: str


@dataclass(frozen=True)
class Assembly:
    """The team as the directives describe it.

    Attributes:
        packages: Folders of the packages that ``package://`` addresses name.
        directives: All directives, nested files opened and file addresses resolved.
        keys: Key of each of them in the scenario file.
        object_model: Name of the object's model.
        robots: The robots in the order of their base models in the directives.
        owners: For each directive the models that it adds or connects.
    """

    packages: PackageMap
    directives: tuple[ModelDirective, ...]
    keys: tuple[str, ...]
    object_model: str
    robots: tuple[RobotAssembly, ...]
    owners: tuple[frozenset[str], ...]

    def of_robot(self, index: int) -> tuple[int, ...]:
        """Indices of the directives that add one robot alone, without its grasp."""
        models = frozenset(self.robots[index].models)
        return tuple(number for number, owners in enumerate(self.owners) if owners and owners <= models)


def assemble(scenario: Scenario) -> Assembly:
    """Read the team's structure from the scenario's directives.

    Raises:
        ScenarioError: A model or frame is not known, a file is missing, there are fewer than two robots, a
            robot has no grasp or two, or a body is welded to the world.
    """
    return _Reader(scenario).assembly()


class _Reader:
    """Reads the directives of one scenario; its file and keys are for messages."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.file = str(scenario.path)
        self.packages = package_map(scenario.path)
        directives = checked_directives(self.file, scenario.directives)
        entries = list(flat(directives, (scenario.path,), self.packages, self.file, "directives"))
        self.keys = tuple(key for key, _ in entries)
        self.directives = tuple(directive for _, directive in entries)
        self.models: dict[str, str] = {}
        self.frames: dict[str, str] = {}
        self._read_names()

    def _refuse(self, key: str, value: object, allowed: str) -> ScenarioError:
        return ScenarioError(self.file, key, value, allowed)

    def _read_names(self) -> None:
        for key, directive in zip(self.keys, self.directives, strict=True):
            if directive.add_model:
                name = directive.add_model.name
                if not _NAME.fullmatch(name):
                    raise self._refuse(f"{key}.add_model.name", name, f"at most {_LONGEST} of {_LETTERS}")
                if name in self.models:
                    raise self._refuse(f"{key}.add_model.name", name, "a name that no other model has")
                self.models[name] = key
            elif directive.add_frame:
                base = directive.add_frame.X_PF.base_frame or ""
                self.frames[directive.add_frame.name] = self._owner(base, f"{key}.add_frame.X_PF.base_frame")

    def _owner(self, frame: str, key: str) -> str:
        """Return the name of the model that a scoped frame belongs to."""
        if frame in self.frames:
            return self.frames[frame]
        scope = frame
        while "::" in scope:
            scope = scope.rpartition("::")[0]
            if scope in self.models:
                return scope
        known = ", ".join(self.models)
        raise self._refuse(key, frame, f"model::frame with a model added before, one of {known}")

    def _weld_owners(self, weld: AddWeld, key: str) -> tuple[str, str]:
        parent = self._owner(weld.parent, f"{key}.add_weld.parent")
        child = self._owner(weld.child, f"{key}.add_weld.child")
        if parent == child:
            raise self._refuse(f"{key}.add_weld.child", weld.child, f"a frame of another model than {parent}")
        return parent, child

    def assembly(self) -> Assembly:
        """Group the models into robots and find the grasps."""
        object_model = self.scenario.object
        if not self.models:
            raise self._refuse("directives", [], "add_model for the object and for two or more robots")
        if object_model not in self.models:
            raise self._refuse(
                "object", object_model, "the name of a model, one of " + ", ".join(self.models)
            )
        self._turn_grasps(object_model)
        welds = [
            (key, d.add_weld, *self._weld_owners(d.add_weld, key))
            for key, d in zip(self.keys, self.directives, strict=True)
            if d.add_weld
        ]
        groups = self._groups(object_model, [(parent, child) for _, _, parent, child in welds])
        robots = [self._robot(group, object_model, welds) for group in groups]
        if len(robots) < 2:
            raise self._refuse("directives", [r.name for r in robots], "two or more robots beside the object")
        return Assembly(
            self.packages,
            self.directives,
            self.keys,
            object_model,
            self._in_order(robots),
            self._all_owners(),
        )

    def _turn_grasps(self, object_model: str) -> None:
        """Make the object the parent of every grasp's weld: then all grasp wrenches have the same sign."""
        turned = []
        for key, directive in zip(self.keys, self.directives, strict=True):
            weld = directive.add_weld
            if weld and self._weld_owners(weld, key)[1] == object_model:
                X_PC = RigidTransform() if weld.X_PC is None else weld.X_PC.GetDeterministicValue()
                turned.append(
                    ModelDirective(
                        add_weld=AddWeld(parent=weld.child, child=weld.parent, X_PC=Transform(X_PC.inverse()))
                    )
                )
            else:
                turned.append(directive)
        self.directives = tuple(turned)

    def _in_order(self, robots: list[RobotAssembly]) -> tuple[RobotAssembly, ...]:
        order = list(self.models)
        return tuple(sorted(robots, key=lambda robot: order.index(robot.name)))

    def _groups(self, object_model: str, edges: list[tuple[str, str]]) -> list[tuple[str, ...]]:
        """Return the groups of models that welds connect when the object is left out."""
        group = {name: name for name in self.models if name != object_model}
        for parent, child in edges:
            if object_model not in (parent, child):
                old, new = group[child], group[parent]
                group = {name: new if root == old else root for name, root in group.items()}
        return [tuple(n for n in group if group[n] == root) for root in dict.fromkeys(group.values())]

    def _robot(
        self, models: tuple[str, ...], object_model: str, welds: list[tuple[str, AddWeld, str, str]]
    ) -> RobotAssembly:
        inner = {child for _, _, parent, child in welds if parent in models and child in models}
        bases = [name for name in models if name not in inner]
        name = bases[0] if bases else models[0]
        if len(bases) != 1:
            raise self._refuse(
                self.models[name],
                list(models),
                "welds that form a tree from one base model; each parent is listed before its child",
            )
        grasps = [weld for _, weld, parent, child in welds if parent == object_model and child in models]
        if len(grasps) != 1:
            raise self._refuse(
                f"{self.models[name]}.add_model.name",
                name,
                f"a robot with exactly one add_weld to a frame of {object_model} (found {len(grasps)})",
            )
        return RobotAssembly(name, models, grasps[0].parent, grasps[0].child, self.models[name])

    def _all_owners(self) -> tuple[frozenset[str], ...]:
        owners = []
        for key, directive in zip(self.keys, self.directives, strict=True):
            if directive.add_model:
                owners.append(frozenset({directive.add_model.name}))
            elif directive.add_frame:
                owners.append(frozenset({self.frames[directive.add_frame.name]}))
            elif directive.add_weld:
                owners.append(frozenset(self._weld_owners(directive.add_weld, key)))
            else:
                owners.append(frozenset())
        return tuple(owners)
