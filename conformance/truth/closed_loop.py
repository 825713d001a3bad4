# SPDX-License-Identifier: MIT
# Written by: python -m conformance.truth.functions
"""The closed loop of the lesson's plant under the controller derived for it; `functions` derived what stands here.

Each function gives a list of arrays, or numbers, from t (s), states and estimates y, and the PARAMETERS p.
"""

from typing import Any

from numpy import cos, sin

FAMILY = "5ffef276542628d72a99638cd119adee24cb26b5efd335f223a1fc46cd482fdf"
PARAMETERS = ("theta", "k1", "k2", "gamma", "amplitude", "omega")


def reference(t: Any, p0: Any, p1: Any, p2: Any, p3: Any, p4: Any, p5: Any) -> list[Any]:
    v0 = p4 * sin(p5 * t)
    v0__t = p4 * p5 * cos(p5 * t)
    return [v0, v0__t]


def control(t: Any, y0: Any, y1: Any, y2: Any, p0: Any, p1: Any, p2: Any, p3: Any, p4: Any, p5: Any) -> list[Any]:
    v0 = p4 * sin(p5 * t)
    v1 = p4 * p5 * cos(p5 * t)
    v2 = -p4 * p5**2 * sin(p5 * t)
    v3 = -v0 + y0
    v4 = v3 * y0
    v5 = -p1 * v3 + v1 - y0 * y2
    v6 = -p1 - y2
    v7 = -v5 + y1
    v8 = -v6 * y0
    v9 = v4 + v7 * v8
    v10 = -y0
    v11 = p1 * v1 - p2 * v7 + p3 * v10 * v9 + v2 - v3 + v6 * y1 - v8 * y2
    return [v11]


def first(t: Any, y0: Any, y1: Any, y2: Any, p0: Any, p1: Any, p2: Any, p3: Any, p4: Any, p5: Any) -> list[Any]:
    v0 = p4 * sin(p5 * t)
    v1 = p4 * p5 * cos(p5 * t)
    v2 = -p4 * p5**2 * sin(p5 * t)
    v3 = -v0 + y0
    v4 = v3 * y0
    v5 = -p1 * v3 + v1 - y0 * y2
    v6 = -p1 - y2
    v7 = -v5 + y1
    v8 = -v6 * y0
    v9 = v4 + v7 * v8
    v10 = -y0
    v11 = p1 * v1 - p2 * v7 + p3 * v10 * v9 + v2 - v3 + v6 * y1 - v8 * y2
    v12 = p3 * v9
    return [p0 * y0 + y1, v11, v12]


def second(t: Any, y0: Any, y1: Any, y2: Any, p0: Any, p1: Any, p2: Any, p3: Any, p4: Any, p5: Any) -> list[Any]:
    v0 = p4 * sin(p5 * t)
    v1 = p4 * p5 * cos(p5 * t)
    v2 = -p4 * p5**2 * sin(p5 * t)
    v3 = -v0 + y0
    v4 = v3 * y0
    v5 = -p1 * v3 + v1 - y0 * y2
    v6 = -p1 - y2
    v7 = -v5 + y1
    v8 = -v6 * y0
    v9 = v4 + v7 * v8
    v10 = -y0
    v11 = p1 * v1 - p2 * v7 + p3 * v10 * v9 + v2 - v3 + v6 * y1 - v8 * y2
    v12 = p3 * v9
    v1__t = -p4 * p5**2 * sin(p5 * t)
    v2__t = -p4 * p5**3 * cos(p5 * t)
    v0__t = p4 * p5 * cos(p5 * t)
    v3__t = -v0__t
    v5__t = -p1 * v3__t + v1__t
    v7__t = -v5__t
    v4__t = v3__t * y0
    v9__t = v4__t + v7__t * v8
    v11__t = p1 * v1__t - p2 * v7__t + p3 * v10 * v9__t + v2__t - v3__t
    v5__y0 = -p1 - y2
    v7__y0 = -v5__y0
    v8__y0 = -v6
    v4__y0 = v3 + y0
    v9__y0 = v4__y0 + v7 * v8__y0 + v7__y0 * v8
    v11__y0 = -p2 * v7__y0 + p3 * v10 * v9__y0 - p3 * v9 - v8__y0 * y2 - 1
    v11__y1 = -p2 + p3 * v10 * v8 + v6
    v5__y2 = -y0
    v7__y2 = -v5__y2
    v9__y2 = v7 * y0 + v7__y2 * v8
    v11__y2 = -p2 * v7__y2 + p3 * v10 * v9__y2 - v8 - y0 * y2 - y1
    v12__t = p3 * v9__t
    v12__y0 = p3 * v9__y0
    v12__y1 = p3 * v8
    v12__y2 = p3 * v9__y2
    return [
        p0 * (p0 * y0 + y1) + v11,
        v11 * v11__y1 + v11__t + v11__y0 * (p0 * y0 + y1) + v11__y2 * v12,
        v11 * v12__y1 + v12 * v12__y2 + v12__t + v12__y0 * (p0 * y0 + y1),
    ]


def errors(t: Any, y0: Any, y1: Any, y2: Any, p0: Any, p1: Any, p2: Any, p3: Any, p4: Any, p5: Any) -> list[Any]:
    v0 = p4 * sin(p5 * t)
    v1 = p4 * p5 * cos(p5 * t)
    v3 = -v0 + y0
    v5 = -p1 * v3 + v1 - y0 * y2
    v7 = -v5 + y1
    return [v3, v7]


def lyapunov(t: Any, y0: Any, y1: Any, y2: Any, p0: Any, p1: Any, p2: Any, p3: Any, p4: Any, p5: Any) -> list[Any]:
    v0 = p4 * sin(p5 * t)
    v1 = p4 * p5 * cos(p5 * t)
    v3 = -v0 + y0
    v5 = -p1 * v3 + v1 - y0 * y2
    v7 = -v5 + y1
    v13 = (1 / 2) * v3**2 + (1 / 2) * v7**2 + (1 / 2) * (-p0 + y2) ** 2 / p3
    return [v13]


def dissipation(t: Any, y0: Any, y1: Any, y2: Any, p0: Any, p1: Any, p2: Any, p3: Any, p4: Any, p5: Any) -> list[Any]:
    v0 = p4 * sin(p5 * t)
    v1 = p4 * p5 * cos(p5 * t)
    v2 = -p4 * p5**2 * sin(p5 * t)
    v3 = -v0 + y0
    v4 = v3 * y0
    v5 = -p1 * v3 + v1 - y0 * y2
    v6 = -p1 - y2
    v7 = -v5 + y1
    v8 = -v6 * y0
    v9 = v4 + v7 * v8
    v10 = -y0
    v11 = p1 * v1 - p2 * v7 + p3 * v10 * v9 + v2 - v3 + v6 * y1 - v8 * y2
    v12 = p3 * v9
    v1__t = -p4 * p5**2 * sin(p5 * t)
    v0__t = p4 * p5 * cos(p5 * t)
    v3__t = -v0__t
    v5__t = -p1 * v3__t + v1__t
    v7__t = -v5__t
    v5__y0 = -p1 - y2
    v7__y0 = -v5__y0
    v5__y2 = -y0
    v7__y2 = -v5__y2
    return [
        p1 * v3**2 + p2 * v7**2,
        2 * p1 * v3 * v3__t
        + 2 * p2 * v11 * v7
        + 2 * p2 * v12 * v7 * v7__y2
        + 2 * p2 * v7 * v7__t
        + (p0 * y0 + y1) * (2 * p1 * v3 + 2 * p2 * v7 * v7__y0),
    ]


def gradients(t: Any, y0: Any, y1: Any, y2: Any, p0: Any, p1: Any, p2: Any, p3: Any, p4: Any, p5: Any) -> list[Any]:
    v0 = p4 * sin(p5 * t)
    v1 = p4 * p5 * cos(p5 * t)
    v3 = -v0 + y0
    v4 = v3 * y0
    v5 = -p1 * v3 + v1 - y0 * y2
    v6 = -p1 - y2
    v7 = -v5 + y1
    v8 = -v6 * y0
    v9 = v4 + v7 * v8
    v10 = -y0
    v5__y0 = -p1 - y2
    v7__y0 = -v5__y0
    v8__y0 = -v6
    v4__y0 = v3 + y0
    v9__y0 = v4__y0 + v7 * v8__y0 + v7__y0 * v8
    v11__y0 = -p2 * v7__y0 + p3 * v10 * v9__y0 - p3 * v9 - v8__y0 * y2 - 1
    v11__y1 = -p2 + p3 * v10 * v8 + v6
    v5__y2 = -y0
    v7__y2 = -v5__y2
    v9__y2 = v7 * y0 + v7__y2 * v8
    v11__y2 = -p2 * v7__y2 + p3 * v10 * v9__y2 - v8 - y0 * y2 - y1
    v12__y0 = p3 * v9__y0
    v12__y1 = p3 * v8
    v12__y2 = p3 * v9__y2
    v13__y0 = v3 + v7 * v7__y0
    v13__y2 = v7 * v7__y2 + (1 / 2) * (-2 * p0 + 2 * y2) / p3
    return [
        p0,
        1,
        0,
        v11__y0,
        v11__y1,
        v11__y2,
        v12__y0,
        v12__y1,
        v12__y2,
        1,
        0,
        0,
        v7__y0,
        1,
        v7__y2,
        v13__y0,
        v7,
        v13__y2,
        2 * p1 * v3 + 2 * p2 * v7 * v7__y0,
        2 * p2 * v7,
        2 * p2 * v7 * v7__y2,
    ]
