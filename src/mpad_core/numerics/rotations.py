"""Unit quaternions (w, x, y, z), scalar first, turning the body's frame into space's; compiled."""

import math

from mpad_core.arrays import Array
from mpad_core.numerics.compiled import compiled_inline


@compiled_inline
def matrix_of(q: Array, out: Array) -> None:
    """Write the rotation matrix (3, 3) of a unit quaternion."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    out[0, 0] = 1 - 2 * (y * y + z * z)
    out[0, 1] = 2 * (x * y - w * z)
    out[0, 2] = 2 * (x * z + w * y)
    out[1, 0] = 2 * (x * y + w * z)
    out[1, 1] = 1 - 2 * (x * x + z * z)
    out[1, 2] = 2 * (y * z - w * x)
    out[2, 0] = 2 * (x * z - w * y)
    out[2, 1] = 2 * (y * z + w * x)
    out[2, 2] = 1 - 2 * (x * x + y * y)


@compiled_inline
def turned(q: Array, rx: float, ry: float, rz: float, out: Array) -> None:
    """Write q turned in space by the rotation vector (rx, ry, rz), normalised; `out` may be `q`."""
    angle = math.sqrt(rx * rx + ry * ry + rz * rz)
    # sin(angle/2)/angle, by its series where the quotient would lose digits
    factor = math.sin(0.5 * angle) / angle if angle > 1e-4 else 0.5 - angle * angle / 48
    aw, ax, ay, az = math.cos(0.5 * angle), factor * rx, factor * ry, factor * rz
    bw, bx, by, bz = q[0], q[1], q[2], q[3]
    w = aw * bw - ax * bx - ay * by - az * bz
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    scale = 1 / math.sqrt(w * w + x * x + y * y + z * z)
    out[0] = w * scale
    out[1] = x * scale
    out[2] = y * scale
    out[3] = z * scale


@compiled_inline
def turned_vector(vx: float, vy: float, vz: float, rx: float, ry: float, rz: float) -> tuple[float, float, float]:
    """Give a vector turned by a rotation vector (Rodrigues)."""
    square = rx * rx + ry * ry + rz * rz
    angle = math.sqrt(square)
    if angle > 1e-4:
        s = math.sin(angle) / angle
        c = (1 - math.cos(angle)) / square
    else:  # the series keep all digits where the quotients would lose them
        s = 1 - square / 6
        c = 0.5 - square / 24
    wx, wy, wz = ry * vz - rz * vy, rz * vx - rx * vz, rx * vy - ry * vx
    return (
        vx + s * wx + c * (ry * wz - rz * wy),
        vy + s * wy + c * (rz * wx - rx * wz),
        vz + s * wz + c * (rx * wy - ry * wx),
    )
