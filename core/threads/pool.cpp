#include "core/threads/pool.h"

#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace sheetbend {
namespace {

thread_local bool inside_worker = false;

void relax() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#else
  std::this_thread::yield();
#endif
}

// Spins before it sleeps: a color takes microseconds, waking a sleeping thread as long again.
constexpr int spins = 4000;

struct Job {
  const std::function<void(int, int)>& body;
  int count, chunks;
  std::atomic<int> left;
  std::atomic<bool> failed = false;
  std::exception_ptr error = nullptr;

  void run(int chunk) {
    const auto bound = [&](int c) { return static_cast<int>(static_cast<long long>(count) * c / chunks); };
    try {
      body(bound(chunk), bound(chunk + 1));
    } catch (...) {
      if (!failed.exchange(true)) error = std::current_exception();
    }
  }
};

// Runs chunk `chunk` of every job that is put into its slot.
class Worker {
 public:
  explicit Worker(int chunk) : chunk_(chunk) {
    std::thread([this] { loop(); }).detach();
  }

  void give(Job& job) {
    job_.store(&job, std::memory_order_release);
    job_.notify_one();
  }

 private:
  void loop() {
    inside_worker = true;
    for (;;) {
      Job* job = nullptr;
      for (int i = 0; i < spins && !(job = job_.load(std::memory_order_acquire)); ++i) relax();
      while (!job) {
        job_.wait(nullptr);
        job = job_.load(std::memory_order_acquire);
      }
      job->run(chunk_);
      job_.store(nullptr, std::memory_order_relaxed);
      job->left.fetch_sub(1, std::memory_order_release);
    }
  }

  alignas(64) std::atomic<Job*> job_ = nullptr;
  int chunk_;
};

class Pool {
 public:
  // False when another thread is using the pool.
  bool run(const std::function<void(int, int)>& body, int count, int chunks) {
    std::unique_lock lock(busy_, std::try_to_lock);
    if (!lock) return false;
    while (static_cast<int>(workers_.size()) < chunks - 1)
      workers_.push_back(std::make_unique<Worker>(static_cast<int>(workers_.size()) + 1));
    Job job{body, count, chunks, chunks - 1};
    for (int c = 1; c < chunks; ++c) workers_[c - 1]->give(job);
    const bool outer = std::exchange(inside_worker, true);
    job.run(0);
    inside_worker = outer;
    for (int i = 0; job.left.load(std::memory_order_acquire) > 0; ++i) i < spins ? relax() : std::this_thread::yield();
    if (job.error) std::rethrow_exception(job.error);
    return true;
  }

 private:
  std::mutex busy_;
  std::vector<std::unique_ptr<Worker>> workers_;
};

std::atomic<Pool*> instance = nullptr;

// One pool per process; leaked on purpose, so that detached workers never outlive what they touch. A child after fork has none of its parent's
// threads and starts its own.
Pool& pool() {
  static const int registered = pthread_atfork(nullptr, nullptr, [] { instance.store(nullptr); });
  static_cast<void>(registered);
  Pool* current = instance.load(std::memory_order_acquire);
  if (current) return *current;
  auto fresh = std::make_unique<Pool>();
  if (instance.compare_exchange_strong(current, fresh.get())) return *fresh.release();
  return *current;
}

}  // namespace

bool run_in_pool(int count, int chunks, const std::function<void(int, int)>& body) {
  return !inside_worker && pool().run(body, count, chunks);
}

}  // namespace sheetbend
