// A small fixed pool. parallel_for splits a range into chunks whose bounds depend on the range and the thread count only, and whose
// results must not depend on the split: callers write to disjoint places. The pool is safe under fork (a child starts its own threads
// on first use) and runs nested calls on the caller's thread.
#pragma once

#include <functional>

namespace sheetbend {

// Calls body(begin, end) on chunks of [0, count) with up to `threads` threads; below `grain` items per thread it uses fewer.
// The first exception thrown by a chunk is rethrown here.
void parallel_for(int count, int threads, int grain, const std::function<void(int, int)>& body);

}  // namespace sheetbend
