template <>
inline Case case_of<TetVolume>() {
  return {.x = {0, 0, 0, 0.1, 0.01, 0.02, -0.01, 0.11, 0.01, 0.02, -0.02, 0.09},
          .p = {1.5e-4},
          .compliance = 1e-6,
          .damping = 1e5,
          .under_rotation = UnderRotation::stays,
          .relabeling = {1, 2, 0, 3},
          .sign = {1},
          .parameter_sign = {1}};
}
