"""Dynamics of a planar mobile manipulator in closed form, z = (x, y, yaw, q...), without a simulator."""

from dataclasses import dataclass

import numpy as np

from coop_drake.laws import robot_dynamics


def perpendicular(vector):
    """Return the vector turned by a right angle."""
    return np.array([-vector[1], vector[0]])


@dataclass(frozen=True)
class PlanarArm:
    """A free base with revolute links in a row; the end effector is the tip of the last link.

    Attributes:
        base_mass: Mass of the base [kg].
        base_inertia: Its moment of inertia about its centre [kg m^2].
        shoulder: First joint in the base frame, shape (2,) [m].
        lengths: Lengths of the links, shape (n,) [m].
        masses: Masses of the links, thin rods, shape (n,) [kg].
    """

    base_mass: float
    base_inertia: float
    shoulder: np.ndarray
    lengths: np.ndarray
    masses: np.ndarray

    def _points(self, z):
        """Return base centre, link centres and tip, each as the hinges (column, position) that move it."""
        angles = z[2] + np.concatenate([[0.0], np.cumsum(z[3:])])
        c, s = np.cos(z[2]), np.sin(z[2])
        joint = z[:2] + np.array([[c, -s], [s, c]]) @ self.shoulder
        hinges, points = [(2, z[:2].copy())], [(z[:2].copy(), 1)]
        for i, length in enumerate(self.lengths):
            hinges.append((3 + i, joint))
            direction = np.array([np.cos(angles[i + 1]), np.sin(angles[i + 1])])
            points.append((joint + 0.5 * length * direction, i + 2))
            joint = joint + length * direction
        points.append((joint, len(hinges)))
        return hinges, points

    def _jacobian(self, z, hinges, point, count):
        jacobian = np.zeros((3, z.size))
        jacobian[0, 0] = jacobian[1, 1] = 1.0
        for column, hinge in hinges[:count]:
            jacobian[:2, column] = perpendicular(point - hinge)
            jacobian[2, column] = 1.0
        return jacobian

    def _rate_term(self, z, z_dot, hinges, point, count):
        """Return J' z': what is left of the acceleration of a point when z'' = 0."""
        acceleration, rate = np.zeros(3), 0.0
        places = [hinge for _, hinge in hinges[1:count]] + [point]
        for (column, hinge), end in zip(hinges[:count], places, strict=True):
            rate += z_dot[column]
            acceleration[:2] -= rate**2 * (end - hinge)
        return acceleration

    def end_effector(self, z, z_dot):
        """Return p_E (2,), J (3, 3 + n) and J' z' (3,)."""
        hinges, points = self._points(z)
        tip, count = points[-1]
        return tip, self._jacobian(z, hinges, tip, count), self._rate_term(z, z_dot, hinges, tip, count)

    def chain(self):
        """Return the arm as the table that ``coop_drake.laws.robot_dynamics`` reads."""
        n = len(self.lengths)
        chain = np.zeros((n + 2, robot_dynamics.COLUMNS))
        chain[0, [robot_dynamics.RATE, robot_dynamics.MASS, robot_dynamics.INERTIA]] = (
            3 + n,
            self.base_mass,
            self.base_inertia,
        )
        joints = self.shoulder[0] + np.concatenate([[0.0], np.cumsum(self.lengths)])
        chain[1:, robot_dynamics.PARENT] = np.arange(n + 1)
        chain[1:, robot_dynamics.X], chain[1:, robot_dynamics.Y] = joints, self.shoulder[1]
        chain[1:-1, robot_dynamics.TURN], chain[1:-1, robot_dynamics.MASS] = 1.0, self.masses
        chain[1:-1, robot_dynamics.POSITION], chain[1:-1, robot_dynamics.RATE] = (
            3 + np.arange(n),
            6 + n + np.arange(n),
        )
        chain[1:-1, robot_dynamics.COM_X], chain[1:-1, robot_dynamics.COM_Y] = (
            joints[:-1] + 0.5 * self.lengths,
            self.shoulder[1],
        )
        chain[1:-1, robot_dynamics.INERTIA] = self.masses * self.lengths**2 / 12.0
        return chain

    def dynamics(self, z, z_dot):
        """Return M (3 + n, 3 + n) and C z' (3 + n,)."""
        hinges, points = self._points(z)
        inertias = np.concatenate([[self.base_inertia], self.masses * self.lengths**2 / 12.0])
        mass_matrix, bias = np.zeros((z.size, z.size)), np.zeros(z.size)
        for (point, count), mass, inertia in zip(
            points[:-1], np.concatenate([[self.base_mass], self.masses]), inertias, strict=True
        ):
            jacobian = self._jacobian(z, hinges, point, count)
            body = np.diag([mass, mass, inertia])
            mass_matrix += jacobian.T @ body @ jacobian
            bias += jacobian.T @ body @ self._rate_term(z, z_dot, hinges, point, count)
        return mass_matrix, bias


def random_arm(rng, joints):
    """Return an arm of warehouse size."""
    return PlanarArm(
        base_mass=rng.uniform(3.0, 9.0),
        base_inertia=rng.uniform(0.1, 0.4),
        shoulder=rng.uniform(-0.1, 0.1, 2),
        lengths=rng.uniform(0.2, 0.5, joints),
        masses=rng.uniform(0.5, 1.5, joints),
    )


def random_state(rng, joints):
    """Return z and z' with moderate speeds."""
    z = np.concatenate([rng.uniform(-2, 2, 2), rng.uniform(-np.pi, np.pi, 1), rng.uniform(-1.8, 1.8, joints)])
    return z, rng.normal(size=z.size)
