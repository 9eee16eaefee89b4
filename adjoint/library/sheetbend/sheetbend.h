/// @file
/// sheetbend in C++: scenes, motions and their derivatives. docs/cpp.md begins with an example.
#pragma once

#include <sheetbend/error.h>
#include <sheetbend/rollout.h>
#include <sheetbend/scene.h>
#include <sheetbend/solver.h>
#include <sheetbend/version.h>
