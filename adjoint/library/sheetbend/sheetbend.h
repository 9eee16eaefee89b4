/// @file
/// sheetbend in C++: scenes, motions and their derivatives. docs/cpp.md begins with an example.
#pragma once

#include <sheetbend/equilibrium.h>
#include <sheetbend/error.h>
#include <sheetbend/residual_function.h>
#include <sheetbend/rollout.h>
#include <sheetbend/scene.h>
#include <sheetbend/solver.h>
#include <sheetbend/stepper.h>
#include <sheetbend/version.h>
