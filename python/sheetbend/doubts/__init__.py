"""Tests of a minimum. They answer these questions, in this order:

1.  Is it a minimum? `stationary`: whether the search ended in one; `roughness`: whether derivatives mean
    anything there; `unstable`: whether a shape at rest is about to snap; `stuck`: whether everything sticks, so that
    friction has only a bound; `beyond_bounds`: whether a bound holds other parameters off; `touching`: which contacts
    change within an interval.
2.  How well are its parameters known? `conclude`: verdicts and intervals; `profiles` and `bootstrap`: other intervals;
    `driven_errors` and `driven_noise`: the noise of what drives a scene; `floors`: the solver's own damping and
    compliance; `losses`: sums of losses that are better known than each; `fitted_bodies`: the inertia of bodies.
3.  Does it explain the recordings, and predict others? `prediction`, `force_comparison`, `leave_one_out`,
    `unexplained`.
4.  Do parts of the data contradict each other? `beginnings`: of motions; `contradictions`: separate parts, another
    start, motion that was held out; `missing_force`: flights.
5.  Were the recordings read right? `misread`: axes, units, order of markers; `misread_forces`;
    `lost_frames`; `smoothed`: filters; `at_limits`: sensors at the end of their range; `implausible`: units of what
    was given.
6.  What does it rest on? `given`: what an error of each given value moves. `told` lists these values and what an
    error of each changes, with `told_words`, `tangents` and `told_inputs` (errors that change inputs of a scene). Some
    of them are in `held_directions`, `lead`, `isotropy`, `sensor_errors`, `marker_mass` and `draft`.
7.  Is a given value wrong, or does the model lack a part? `wrong_given` tests all of them: `causes` and
    `two_directions` find the one or two that explain the residuals, among the directions of `lacking`:
    `missing_parts`, `losses_at_zero`, `cloth_size`, `pinned_ends` and `smoothed`. `spin` tests the ends of rods.
8.  Does the motion lose energy in another way? `missing_loss`, `held_losses` and `losses_beside_contacts` test it to
    first order (`directions`), `other_losses`, `absent_damping` and `absent_bounce` by fits (`more_parameters`).
"""
