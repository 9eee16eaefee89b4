#include "core/threads/pool.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace sheetbend {
namespace {

thread_local bool inside_worker = false;

struct Job {
  const std::function<void(int, int)>* body;
  int count, chunks;
  int next, done;
  std::exception_ptr error;
};

class Pool {
 public:
  void run(const std::function<void(int, int)>& body, int count, int chunks) {
    Job job{&body, count, chunks, 0, 0, nullptr};
    {
      std::lock_guard lock(mutex_);
      grow(chunks - 1);
      for (int i = 1; i < chunks; ++i) queue_.push_back(&job);
    }
    wake_.notify_all();
    work(job);
    std::unique_lock lock(mutex_);
    std::erase(queue_, &job);
    finished_.wait(lock, [&] { return job.done == job.chunks; });
    if (job.error) std::rethrow_exception(job.error);
  }

 private:
  void grow(int wanted) {
    while (static_cast<int>(size_) < wanted) {
      std::thread([this] { loop(); }).detach();
      ++size_;
    }
  }

  void loop() {
    inside_worker = true;
    for (;;) {
      Job* job;
      {
        std::unique_lock lock(mutex_);
        wake_.wait(lock, [&] { return !queue_.empty(); });
        job = queue_.front();
        queue_.pop_front();
        if (job->next == job->chunks) continue;
        take(*job, lock);
      }
    }
  }

  // Runs chunks of the job until none is left. The lock is held on entry and on exit of take().
  void work(Job& job) {
    std::unique_lock lock(mutex_);
    while (job.next < job.chunks) take(job, lock);
  }

  void take(Job& job, std::unique_lock<std::mutex>& lock) {
    const int chunk = job.next++;
    lock.unlock();
    std::exception_ptr error;
    const bool outer = std::exchange(inside_worker, true);
    try {
      const auto bound = [&](int c) { return static_cast<int>(static_cast<long long>(job.count) * c / job.chunks); };
      (*job.body)(bound(chunk), bound(chunk + 1));
    } catch (...) {
      error = std::current_exception();
    }
    inside_worker = outer;
    lock.lock();
    if (error && !job.error) job.error = error;
    if (++job.done == job.chunks) finished_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable wake_, finished_;
  std::deque<Job*> queue_;
  std::size_t size_ = 0;
};

// One pool per process; leaked on purpose, so that detached workers never outlive what they touch. No lock is held here that a fork could
// leave locked: two threads that race for the first pool of a process both make one, and one is used.
Pool& pool() {
  struct Owned {
    pid_t process;
    Pool pool;
  };
  static std::atomic<Owned*> instance = nullptr;
  Owned* current = instance.load();
  while (current == nullptr || current->process != getpid()) {
    auto fresh = std::make_unique<Owned>(getpid());
    if (instance.compare_exchange_strong(current, fresh.get())) return fresh.release()->pool;
  }
  return current->pool;
}

}  // namespace

void parallel_for(int count, int threads, int grain, const std::function<void(int, int)>& body) {
  const int chunks = std::min(threads, count / std::max(grain, 1));
  if (chunks <= 1 || inside_worker) {
    if (count > 0) body(0, count);
    return;
  }
  pool().run(body, count, chunks);
}

}  // namespace sheetbend
