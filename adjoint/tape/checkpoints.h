// Which states of a rollout are kept, and which are computed again, so that its reverse never holds more than a given number of them:
// binomial checkpointing (Griewank & Walther 2000, algorithm 799, revolve), for programs that restart from their last `window` states.
// A stretch whose states all fit is kept state by state, one more each, so the tape of every boundary is the case of a large budget; with
// window = 1 the schedule is revolve's, with the same number of advances.
#pragma once

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <variant>
#include <vector>

namespace sheetbend {

struct Advance {
  int from, to,
      keep;  // runs forward from the state at `from`, and keeps those at keep .. to; all others after `from` can go
};
struct Reverse {
  int step;  // from step + 1 to step; the state at `step` is kept
};
using Action = std::variant<Advance, Reverse>;

// n over k, or `limit` where that is less.
inline long binomial(long n, long k, long limit) {
  long value = 1;
  for (long i = 1; i <= std::min(k, n - k) && value < limit; ++i) value = value * (n - std::min(k, n - k) + i) / i;
  return k < 0 || k > n ? 0 : std::min(value, limit);
}

// The longest stretch that `free` states besides its first reverse without advancing any step more than `times` times (at most `limit`):
// reach(free, times) = reach(free, times - 1) + reach(free - window, times), reach(free, 1) = free + 1 = reach(free < window, times).
inline long reach(long free, long times, long window, long limit) {
  if (times == 0) return 1;
  const long checkpoints = free / window, left = free % window, n = checkpoints + times - 1;
  return std::min(limit, (left + 1) * binomial(n, checkpoints, limit) + window * binomial(n, times, limit));
}

class Schedule {
 public:
  // states >= least(steps, window) may be kept at a time, the initial one among them.
  Schedule(int steps, int states, int window) : window_(window) {
    if (states < least(steps, window)) throw std::invalid_argument("too few states can be kept to reverse the rollout");
    if (steps > 0) open_.push_back({0, steps, states - 1});
  }

  static int least(int steps, int window) { return steps <= 1 ? 1 : 1 + std::min(window, steps - 1); }

  // The next thing to do, until all steps are reversed.
  std::optional<Action> next() {
    while (!open_.empty()) {
      Stretch& s = open_.back();
      if (s.begin == s.end) {
        open_.pop_back();
      } else if (s.end - s.begin > s.free + 1) {
        const int middle = s.begin + split(s.end - s.begin, s.free);
        const Stretch right{middle, s.end, s.free - window_}, left = s;
        s.end = middle;
        open_.push_back(right);
        return Advance{left.begin, middle, std::max(left.begin, middle - window_) + 1};
      } else if (!s.kept && s.end - s.begin > 1) {
        s.kept = true;
        return Advance{s.begin, s.end - 1, s.begin + 1};
      } else {
        return Reverse{--s.end};
      }
    }
    return std::nullopt;
  }

 private:
  struct Stretch {
    int begin, end, free;  // the state at `begin` is kept, and `free` more can be
    bool kept = false;
  };

  // Where to cut a stretch that is too long, so that both parts are within reach and no step is advanced more often than need be.
  int split(long length, long free) const {
    long times = 2;
    for (long step = 1; reach(free, times, window_, length) < length; times += step) step *= 2;
    for (long low = 2; low < times;) {
      const long middle = (low + times) / 2;
      reach(free, middle, window_, length) < length ? low = middle + 1 : times = middle;
    }
    return static_cast<int>(
        std::min(reach(free, times - 1, window_, length), length - reach(free - window_, times - 1, window_, length)));
  }

  int window_;
  std::vector<Stretch> open_;
};

// Steps that the reverse advances again, after the forward program has run once and kept what the schedule's first advances name.
inline long recomputed_steps(int steps, int states, int window) {
  Schedule schedule(steps, states, window);
  long advanced = 0;
  while (const auto action = schedule.next())
    if (const auto* advance = std::get_if<Advance>(&*action)) advanced += advance->to - advance->from;
  return advanced - std::max(0, steps - 1);
}

}  // namespace sheetbend
