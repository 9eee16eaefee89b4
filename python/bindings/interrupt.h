// Ctrl-C during long work that has released the GIL: the calling thread looks for signals now and then.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

#include "core/solver/interrupt.h"

namespace sheetbend::bindings {

struct Interrupted : std::runtime_error {
  Interrupted() : std::runtime_error("interrupted") {}
};

class SignalInterrupt : public Interrupt {
 public:
  void poll() override {
    if (requested_) throw Interrupted();
    if (std::this_thread::get_id() != caller_) return;
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(50)) return;
    last_ = now;
    pybind11::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) {
      PyErr_Clear();
      requested_ = true;
      throw Interrupted();
    }
  }

 private:
  std::atomic<bool> requested_ = false;
  std::thread::id caller_ = std::this_thread::get_id();
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace sheetbend::bindings
