#include "shm/pool/memory_trash.hpp"

#include <memory>
#include <utility>

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>

#include "shm/files/memory_file.hpp"
#include "shm/threads/thread.hpp"

namespace plchost {

namespace {

constexpr std::uint64_t kAtOnce = std::uint64_t{16} << 20;  // bytes that are free within some 2 ms
constexpr int kBlock = 512;                                 // of st_blocks

}  // namespace

bool MemoryTrash::take(const std::string& name) noexcept {
  UniqueFd fd(::open(MemoryFile::path(name).c_str(), O_PATH | O_NOFOLLOW | O_CLOEXEC));
  if (!MemoryFile::remove(name)) return false;
  struct stat status{};
  if (!fd || ::fstat(fd.get(), &status) != 0 || status.st_nlink != 0) return true;
  bytes_ += static_cast<std::uint64_t>(status.st_blocks) * kBlock;
  held_.push_back(std::move(fd));
  return true;
}

MemoryTrash::~MemoryTrash() {
  if (bytes_ < kAtOnce) return;
  auto held = std::make_shared<std::vector<UniqueFd>>(std::move(held_));
  auto thread = Thread::start("pool-trash", {}, [held] {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, nullptr);  // they are the program's
    held->clear();
  });
  if (thread) thread->detach();
}

}  // namespace plchost
