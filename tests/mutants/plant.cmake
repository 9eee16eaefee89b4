# Plants wrong reverses of contacts in copies of the sources that they would be in: cmake -D FROM=repository -D TO=folder -P plant.cmake
# What is replaced has to be there exactly once, or this fails. Change it together with the source.

foreach(path core/solver/newton_matrix.cpp adjoint/contact/law_vjp.h adjoint/tape/tape.h)
  configure_file(${FROM}/${path} ${TO}/${path} COPYONLY)
endforeach()

function(plant path right wrong)
  file(READ "${TO}/${path}" text)
  string(FIND "${text}" "${right}" first)
  string(FIND "${text}" "${right}" last REVERSE)
  if(first EQUAL -1 OR NOT first EQUAL last)
    message(FATAL_ERROR "${path} has not one place with:\n  ${right}\nin which tests/mutants/plant.cmake plants a mutant")
  endif()
  string(REPLACE "${right}" "${wrong}" text "${text}")
  file(WRITE "${TO}/${path}" "${text}")
endfunction()

# Only the reverse and the tangents ask for the curved matrix. What is not symmetric in it is contacts alone, so that their transposes transpose it.
plant(core/solver/newton_matrix.cpp
      "    symmetric_ = symmetric_ && is_symmetric(M);\n"
      "    for (int a = 0; curved && a < 3; ++a)
      for (int b = 0; b < a; ++b) {
        if (planted(\"not_transposed\")) std::swap(M[3 * a + b], M[3 * b + a]);
        if (planted(\"symmetric_part\")) M[3 * a + b] = M[3 * b + a] = 0.5 * (M[3 * a + b] + M[3 * b + a]);
      }
    symmetric_ = symmetric_ && is_symmetric(M);\n")
plant(core/solver/newton_matrix.cpp
      "contacts.numbers[i], curved, A)"
      "contacts.numbers[i], curved && !planted(\"flat_collider\"), A)")
plant(adjoint/contact/law_vjp.h
      "  bar.carried = trial_bar;\n"
      "  if (!planted(\"carried_forgotten\")) bar.carried = trial_bar;\n")
plant(adjoint/tape/tape.h
      "    if (!first_order_.empty()) return first_order_[step];\n"
      "    if (!first_order_.empty() && !planted(\"formula_ignored\")) return first_order_[step];\n")
