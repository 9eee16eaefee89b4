"""Reference values for physics tests, from closed forms or small independent solvers.

Nothing here imports sheetbend. Every function is pure, takes SI units and returns floats, complex numbers or
arrays. The numbers O-1, O-2, ... name the cases; each docstring says what the case is, which discrete program
it holds for, and how closely a simulation must agree. "Exact" means to rounding (1e-12 in double precision).

    calculus      derivative                              parameter derivatives where no closed form is given
    integration   O-1, 2, 3, 3b, 4, 5s, 13                one particle or one link under BDF1 and BDF2
    pendulums     O-7, 7b, 12, 14                         rigid links in gravity or in an electric field
    drag          O-11                                    falling against air
    ropes         O-5, 5d, 6, 8, 9                        hanging ropes at rest
    modes         O-10a, 10b, 16a                         small vibrations
    bending       O-15, 17, 21                            large deflections of a strip or a bent chain
"""
