"""The impact of one contact point with friction.

The impulse grows little by little, and with it the velocity changes (E. J. Routh, Dynamics of a System of Rigid Bodies,
elementary part, 7th ed., 1905; J. B. Keller, Journal of Applied Mechanics 53 (1986) 1-4): while the point slides,
friction is mu times the normal impulse and opposed to the sliding, whose direction may turn meanwhile; what has stopped
sticks if friction can hold it, and else slides off along the one straight line that it can. The normal impulse first
takes up energy, then gives back e^2 of it (W. J. Stronge, Proceedings of the Royal Society A 431 (1990) 169-181). So no
impact gains energy, whatever the geometry, and without friction it is Newton's.

Vectors have a component along the normal, then two along the tangents. The inverse mass is a symmetric matrix (nine
numbers by rows): the velocity of b against a changes by it times the impulse on b.
"""

import math

from particlesim.core.jit import kernel
from particlesim.core.math3d import add, axpy, dot, mat_vec, norm, scale
from particlesim.core.quadrature import STAGES, WEIGHTS
from particlesim.dynamics.settings import MAX_SLIP_STEPS, SLIP_STEP, STOPPED


@kernel
def work_of(inverse_mass, velocity, impulse):
    """The energy that an impulse gives to bodies whose contact point has a velocity [J]."""
    return dot(velocity, impulse) + 0.5 * dot(impulse, mat_vec(inverse_mass, impulse))


@kernel
def _solve_tangential(inverse_mass, more, x, y):
    """The tangential vector that the tangential inverse mass, with ``more`` on its diagonal, makes (x, y)."""
    a, b, d = inverse_mass[4] + more, inverse_mass[5], inverse_mass[8] + more
    determinant = a * d - b * b
    return (d * x - b * y) / determinant, (a * y - b * x) / determinant


# ---- sliding -------------------------------------------------------------------------------------------------------
# The point is followed in s, by which the tangential impulse grows by minus the sliding velocity, and the normal one
# by its length over mu. So it is regular where the sliding stops, which it approaches exponentially, and an infinite mu
# is nothing special.


@kernel
def _slip_rate(inverse_mass, inverse_friction, x, y):
    """Rates in s of the sliding velocity (x, y) and of the normal velocity."""
    pressed = inverse_friction * math.sqrt(x * x + y * y)
    change = mat_vec(inverse_mass, (pressed, -x, -y))
    return change[1], change[2], change[0]


@kernel
def _stage(velocity, rates, weights, step):
    """What ``velocity`` becomes under the weighted sum of three rates: (x, y, normal)."""
    x, y, n = velocity[1], velocity[2], velocity[0]
    for k in range(3):
        w, rate = weights[k] * step, rates[k]
        x, y, n = x + w * rate[0], y + w * rate[1], n + w * rate[2]
    return x, y, n


@kernel
def _slide(inverse_mass, inverse_friction, velocity, step):
    """Slide on by a ``step`` in s: the impulse, the work of its normal part, and what friction took.

    Energy is quadratic: the quadrature keeps its balance to rounding, whatever the step. Both parts of the impulse are
    sums over the stages, so it is within the cone.
    """
    rate = _slip_rate(inverse_mass, inverse_friction, velocity[1], velocity[2])
    rates = (rate, rate, rate)
    limit = 1e-16 * (abs(rate[0]) + abs(rate[1]))
    for _ in range(60):
        xa, ya, _ = _stage(velocity, rates, STAGES[0], step)
        xb, yb, _ = _stage(velocity, rates, STAGES[1], step)
        xc, yc, _ = _stage(velocity, rates, STAGES[2], step)
        a = _slip_rate(inverse_mass, inverse_friction, xa, ya)
        b = _slip_rate(inverse_mass, inverse_friction, xb, yb)
        c = _slip_rate(inverse_mass, inverse_friction, xc, yc)
        change = abs(a[0] - rates[0][0]) + abs(a[1] - rates[0][1]) + abs(c[0] - rates[2][0]) + abs(c[1] - rates[2][1])
        rates = (a, b, c)
        if change <= limit:
            break
    impulse, work, rubbed = (0.0, 0.0, 0.0), 0.0, 0.0
    for k in range(3):
        x, y, n = _stage(velocity, rates, STAGES[k], step)
        part = step * WEIGHTS[k]
        square = x * x + y * y
        pressed = inverse_friction * math.sqrt(square)
        impulse = axpy(impulse, (pressed, -x, -y), part)
        work += part * pressed * n
        rubbed += part * square
    return impulse, work, rubbed


@kernel
def _slide_until(inverse_mass, inverse_friction, velocity, step, goal):
    """Slide on until the normal work reaches its ``goal``; if that is not above 0, until the normal velocity is 0.

    One of the two happens within the ``step``. (Regula falsi with Illinois' halving.) As ``_slide``, and the normal
    velocity then.
    """
    by_work = goal > 0.0
    low, high = 0.0, step
    at_low = -goal if by_work else velocity[0]
    scale_of = abs(at_low)
    slid = _slide(inverse_mass, inverse_friction, velocity, high)
    at_high = slid[1] - goal if by_work else velocity[0] + mat_vec(inverse_mass, slid[0])[0]
    side = 0
    for _ in range(60):
        middle = high - at_high * (high - low) / (at_high - at_low)
        slid = _slide(inverse_mass, inverse_friction, velocity, middle)
        found = slid[1] - goal if by_work else velocity[0] + mat_vec(inverse_mass, slid[0])[0]
        if abs(found) <= 1e-15 * scale_of or not low < middle < high:
            break
        if (found > 0.0) == (at_high > 0.0):
            high, at_high = middle, found
            at_low *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            low, at_low = middle, found
            at_high *= 0.5 if side == -1 else 1.0
            side = -1
    return slid


@kernel
def _longest_slip(inverse_mass, inverse_friction, speed, first):
    """A step in s that is short against the changes of the sliding velocity, less so where it is small by now."""
    coupling = math.hypot(inverse_mass[1], inverse_mass[2])
    fastest = inverse_mass[4] + inverse_mass[8] + inverse_friction * coupling
    return min(SLIP_STEP * (first / speed) ** (1.0 / 7.0), 1.0) / fastest


@kernel
def _slip(inverse_mass, inverse_friction, returned, velocity, impulse):
    """Follow a point until it stops or its bodies part.

    ``returned`` is the fraction of the energy taken up that comes back. Returns (velocity, impulse, energy taken up and
    still there, what friction took, whether they parted).
    """
    first = norm(velocity)
    stored = rubbed = 0.0
    for _ in range(MAX_SLIP_STEPS):
        speed = math.hypot(velocity[1], velocity[2])
        if speed <= STOPPED * first:
            break
        step = _longest_slip(inverse_mass, inverse_friction, speed, first)
        pushed, work, heat = _slide(inverse_mass, inverse_friction, velocity, step)
        before, after = velocity[0], velocity[0] + mat_vec(inverse_mass, pushed)[0]
        turned = (before < 0.0 < after) or (after < 0.0 < before)
        if turned:
            pushed, work, heat = _slide_until(inverse_mass, inverse_friction, velocity, step, 0.0)
            after = 0.0
        parted = False
        if before < 0.0 or after < 0.0:
            stored -= work
        else:
            goal = returned * stored
            if goal <= 0.0:
                return velocity, impulse, 0.0, rubbed, True
            parted = work >= goal
            if parted:
                pushed, work, heat = _slide_until(inverse_mass, inverse_friction, velocity, step, goal)
            stored -= work / returned
        velocity, impulse, rubbed = add(velocity, mat_vec(inverse_mass, pushed)), add(impulse, pushed), rubbed + heat
        if parted:
            return velocity, impulse, 0.0, rubbed, True
        if turned:
            velocity = (0.0, velocity[1], velocity[2])
    return velocity, impulse, stored, rubbed, False


# ---- after it has stopped ------------------------------------------------------------------------------------------


@kernel
def _slip_direction(inverse_mass, friction):
    """The direction in which a point that cannot stick slides off, and its acceleration in the normal impulse.

    Along it the sliding velocity goes on straight: coupling - mu A s = l s with l > 0, of which there is one. (Newton's
    method on 1 / |s|, which rises to it from l = 0: J. J. More, D. C. Sorensen, SIAM Journal on Scientific and
    Statistical Computing 4 (1983) 553-572.)
    """
    least = 0.0
    x, y = _solve_tangential(inverse_mass, 0.0, inverse_mass[1], inverse_mass[2])
    x, y = x / friction, y / friction
    for _ in range(60):
        length = math.hypot(x, y)
        across = _solve_tangential(inverse_mass, least / friction, x, y)
        grown = least + (length - 1.0) * length * length * friction / (x * across[0] + y * across[1])
        if not grown > least:
            break
        least = grown
        x, y = _solve_tangential(inverse_mass, least / friction, inverse_mass[1], inverse_mass[2])
        x, y = x / friction, y / friction
    length = math.hypot(x, y)
    return x / length, y / length, least


@kernel
def _normal_impulse_to_part(velocity, growth, stored, returned):
    """The normal impulse until bodies part whose normal velocity grows by ``growth`` for each unit of it."""
    impulse = 0.0
    if velocity < 0.0:
        impulse, stored, velocity = -velocity / growth, stored + 0.5 * velocity * velocity / growth, 0.0
    return impulse + (math.sqrt(velocity * velocity + 2.0 * growth * returned * stored) - velocity) / growth


@kernel
def coulomb_impulse(inverse_mass, velocity, restitution, friction, static_friction):
    """The impulse on b of an impact with friction, what friction took [J], and whether the point stuck in the end."""
    returned = restitution * restitution
    start = (0.0, 0.0, 0.0)
    velocity, impulse, stored, rubbed, parted = _slip(inverse_mass, 1.0 / friction, returned, velocity, start)
    if parted:
        return impulse, rubbed, False
    hold_x, hold_y = _solve_tangential(inverse_mass, 0.0, inverse_mass[1], inverse_mass[2])
    needed = math.hypot(hold_x, hold_y)
    if needed <= static_friction:
        # What is left of the sliding is rounding; it ends at once.
        left_x, left_y = _solve_tangential(inverse_mass, 0.0, velocity[1], velocity[2])
        rubbed += 0.5 * (left_x * velocity[1] + left_y * velocity[2])
        impulse = add(impulse, (0.0, -left_x, -left_y))
        parting = velocity[0] - inverse_mass[1] * left_x - inverse_mass[2] * left_y
        growth = inverse_mass[0] - inverse_mass[1] * hold_x - inverse_mass[2] * hold_y
        pressed = _normal_impulse_to_part(parting, growth, stored, returned)
        return axpy(impulse, (1.0, -hold_x, -hold_y), pressed), rubbed, True
    x, y, faster = _slip_direction(inverse_mass, friction)
    growth = inverse_mass[0] - friction * (inverse_mass[1] * x + inverse_mass[2] * y)
    pressed = _normal_impulse_to_part(velocity[0], growth, stored, returned)
    sliding = x * velocity[1] + y * velocity[2] + 0.5 * faster * pressed
    return axpy(impulse, (1.0, -friction * x, -friction * y), pressed), rubbed + friction * sliding * pressed, False


# ---- tangential restitution ----------------------------------------------------------------------------------------


@kernel
def within_cone(impulse, change, friction):
    """The largest factor up to 1 on a tangential ``change`` that leaves an impulse within its cone; 0 if none does."""
    square = change[1] * change[1] + change[2] * change[2]
    product = impulse[1] * change[1] + impulse[2] * change[2]
    edge = friction * impulse[0]
    room = edge * edge - impulse[1] * impulse[1] - impulse[2] * impulse[2]
    if square == 0.0 or square + 2.0 * product <= room:
        return 1.0
    root = math.sqrt(max(product * product + square * room, 0.0))
    factor = (root - product) / square if product <= 0.0 else room / (root + product)
    return factor if 0.0 < factor < 1.0 else 0.0


@kernel
def _given_back(inverse_mass, velocity, impulse, law, rubbed):
    """The tangential impulse that a point that stuck gives back, and its energy.

    It goes on along what stopped the sliding, up to the tangential restitution of it: as far as it stays within the
    cone, gives back no more than the square of that of what friction took, and does not make the bodies approach.
    """
    x, y = _solve_tangential(inverse_mass, 0.0, velocity[1], velocity[2])
    taken = x * velocity[1] + y * velocity[2]
    if taken <= 0.0:
        return (0.0, 0.0, 0.0), 0.0
    beta = law.tangential_restitution
    factor = beta * min(1.0, math.sqrt(2.0 * rubbed / taken))
    parting = max(velocity[0] + mat_vec(inverse_mass, impulse)[0], 0.0)
    closing = inverse_mass[1] * x + inverse_mass[2] * y
    if factor * closing > parting:
        factor = parting / closing
    back = (0.0, -factor * x, -factor * y)
    within = within_cone(impulse, back, law.friction)
    return scale(back, within), 0.5 * within * within * factor * factor * taken


@kernel
def _smoothed(inverse_mass, velocity, restitution, law):
    """The impulse of a point whose tangential restitution is below 0, and what friction took.

    It is between that of a smooth point and of one that is rougher by as much: spheres that would stick keep minus the
    tangential restitution of their sliding velocity, and those that slide take all that Coulomb allows. Energy is
    convex in the impulse: what lies between two that gain none gains none.
    """
    share = 1.0 + law.tangential_restitution
    smooth = (-(1.0 + restitution) * velocity[0] / inverse_mass[0], 0.0, 0.0)
    if share <= 0.0:
        return smooth, 0.0
    rough, rubbed, _ = coulomb_impulse(
        inverse_mass, velocity, restitution, law.friction / share, law.static_friction / share
    )
    change = (rough[0] - smooth[0], rough[1], rough[2])
    beyond = math.hypot(rough[1], rough[2]) - law.friction * change[0]
    if share * beyond > law.friction * smooth[0]:
        share = law.friction * smooth[0] / beyond
    apart = dot(change, mat_vec(inverse_mass, change))
    return axpy(smooth, change, share), share * rubbed + 0.5 * share * (1.0 - share) * apart


@kernel
def point_impulse(inverse_mass, velocity, restitution, law):
    """The impulse on b of the impact of one point, and what friction took [J].

    Parameters
    ----------
    inverse_mass : nine floats
        By rows, see above [1/kg].
    velocity : three floats
        Of b against a at the point; the first is below 0 [m/s].
    restitution : float
        Of this impact.
    law : CONTACT_LAW
        With friction.
    """
    if law.tangential_restitution < 0.0:
        return _smoothed(inverse_mass, velocity, restitution, law)
    impulse, rubbed, stuck = coulomb_impulse(inverse_mass, velocity, restitution, law.friction, law.static_friction)
    if stuck and law.tangential_restitution > 0.0:
        back, energy = _given_back(inverse_mass, velocity, impulse, law, rubbed)
        impulse, rubbed = add(impulse, back), rubbed - energy
    return impulse, rubbed


@kernel
def sphere_impulse(inverse_mass, velocity, restitution, law):
    """The impulse on b, and what friction took, where tangential and normal impulses do not see each other: of spheres.

    ``inverse_mass`` is (along the normal, along any tangent). (O. R. Walton, R. L. Braun, Journal of Rheology 30 (1986)
    949-980; S. F. Foerster, M. Y. Louge, H. Chang, K. Allia, Physics of Fluids 6 (1994) 1108-1115.)
    """
    along, across = inverse_mass
    pressed = (1.0 + restitution) * (-velocity[0] / along)
    speed = math.hypot(velocity[1], velocity[2])
    if speed == 0.0:
        return (pressed, 0.0, 0.0), 0.0
    sticking = (1.0 + law.tangential_restitution) * speed / across
    rubbing = min(sticking, law.friction * pressed)
    factor = -rubbing / speed
    return (pressed, factor * velocity[1], factor * velocity[2]), rubbing * (speed - 0.5 * across * rubbing)
