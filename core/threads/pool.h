// A small fixed pool. parallel_for splits a range into chunks whose bounds depend on the range and the thread count only, and whose
// results must not depend on the split: callers write to disjoint places. The pool is safe under fork (a child starts its own threads
// on first use) and runs nested calls, and those of a second thread while it is busy, on the caller's thread.
#pragma once

#include <algorithm>
#include <functional>

namespace sheetbend {

// Particles per thread below which loops over them are not split. Such loops are split as the colors are: a loop on one thread would pull every
// particle's numbers out of the other threads' caches.
inline constexpr int points_per_thread = 256;

// False where the caller has to do the work itself.
bool run_in_pool(int count, int chunks, const std::function<void(int, int)>& body);

// Calls body(begin, end) on chunks of [0, count) with up to `threads` threads; below `grain` items per thread it uses fewer.
// An exception thrown by a chunk is rethrown here (the first one of several).
template <class Body>
void parallel_for(int count, int threads, int grain, Body&& body) {
  if (count <= 0) return;
  const int chunks = std::min(threads, count / std::max(grain, 1));
  if (chunks <= 1 || !run_in_pool(count, chunks, std::ref(body))) body(0, count);
}

}  // namespace sheetbend
