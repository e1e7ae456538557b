#include "manager/store/wish_store.hpp"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "instances/launch/launch_contract.hpp"
#include "shm/base/system_call.hpp"
#include "shm/base/unique_fd.hpp"
#include "shm/files/replace_file.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// not_found: there is none, or no folder of ours. wrong_type: it is no plain file. refused: it is another
// user's.
Result<std::string> read_wish_file(const std::string& path, std::size_t most) {
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  if (!fd) {
    const int error = errno;
    const std::string folder = std::filesystem::path(path).parent_path();
    // A folder that this user may not even look into was never one of his manager's.
    const bool none =
        error == ENOENT || error == ENOTDIR || (error == EACCES && ::access(folder.c_str(), X_OK) != 0);
    return failure(none ? ErrorCode::not_found : ErrorCode::system, "cannot open " + path, error);
  }
  struct stat status{};
  PLCHOST_TRY(check_errno(::fstat(fd.get(), &status), "cannot examine " + path));
  if (!S_ISREG(status.st_mode)) return failure(ErrorCode::wrong_type, path + " is no plain file");
  if (status.st_uid != ::geteuid() && status.st_uid != 0) {
    return failure(ErrorCode::refused,
                   fmt::format("{} is no file of this user, but of user {}", path, status.st_uid));
  }
  std::string text(most + 1, '\0');
  PLCHOST_TRY_ASSIGN(const auto got,
                     check_errno(::read(fd.get(), text.data(), text.size()), "cannot read " + path));
  text.resize(static_cast<std::size_t>(got));
  return text;
}

// Than any that a disk may have: later wishes are newer.
std::uint32_t higher_number(std::uint32_t known) {
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  return std::max(known, static_cast<std::uint32_t>(unix_time_ns() / kNsPerSecond));
}

std::string registered_events_path(const std::string& run_directory, const std::string& instance) {
  return fmt::format("{}/{}.events", run_directory, instance);
}

}  // namespace

WishStore::WishStore(Reactor& reactor, WishWriter& writer, DiskThread& disk, Settings settings)
    : writer_(writer),
      disk_(disk),
      settings_(std::move(settings)),
      limit_(reactor,
             [this] {
               tell(fmt::format("the disk has not taken it within {} s",
                                std::chrono::duration_cast<std::chrono::seconds>(kWishLimit).count()));
             }),
      retry_(reactor, [this] { write(); }) {}

Result<std::optional<InstanceWish>> WishStore::find() {
  auto memory = WishMemory::open(settings_.pool, settings_.instance);
  damaged_ = memory ? memory->damaged() : memory.error().code == ErrorCode::corrupt;
  if (memory) {
    memory_ = *std::move(memory);
  } else {
    spdlog::error("instance {}: its wanted state is not kept for the next manager: {}", settings_.instance,
                  memory.error().describe());
  }
  auto remembered = memory_ ? memory_->read() : std::nullopt;
  const auto file = read_file(path(), kMaxWishBytes, remembered ? kWishReadLimit : kOnlyWishReadLimit);
  auto wish = and_then(file, decode_wish);
  if (file) wanted_ = written_ = *file;
  if (wish) {
    number_ = std::exchange(wish->number, 0);
    contents_ = encode(*wish);
  }
  const bool silent = !file && file.error().code == ErrorCode::timed_out;
  // After an end in order the disk may know a boot application, and what a power cut would leave.
  if (silent && (!remembered || remembered->host_ended)) {
    number_ = higher_number(0);
    return std::unexpected(file.error());
  }
  if (silent) {
    remembered->number = higher_number(remembered->number);
    spdlog::error("instance {}: its wanted state is taken from memory: {}", settings_.instance,
                  file.error().describe());
  }
  if (remembered) {
    return take_remembered(*std::move(remembered), wish ? std::optional(*std::move(wish)) : std::nullopt);
  }
  if (damaged_) return take_without_memory(wish);
  if (!file && file.error().code == ErrorCode::not_found) return std::nullopt;
  if (!wish) {
    return failure(ErrorCode::corrupt, fmt::format("{}: {}", path(), wish.error().describe()));
  }
  restore_events();
  return wish->after_power_cut();
}

// `kept`: of the disk. It may be older than what another program has written over: a stop that the disk did
// not take in time.
Result<std::optional<InstanceWish>> WishStore::take_without_memory(const Result<InstanceWish>& kept) const {
  constexpr std::string_view kWhy = "another program has written over the memory that holds it";
  if (!kept) return failure(ErrorCode::corrupt, std::string(kWhy));
  if (!kept->commanded || kept->running) {
    return failure(ErrorCode::corrupt, fmt::format("{}, and {} may be older", kWhy, path()));
  }
  spdlog::error("instance {}: its wanted state is taken from {}, which may be older: {}", settings_.instance,
                path(), kWhy);
  restore_events();
  return kept->after_power_cut();
}

// `kept`: of the disk, with number_.
Result<std::optional<InstanceWish>> WishStore::take_remembered(InstanceWish remembered,
                                                               std::optional<InstanceWish> kept) {
  if (kept && number_ > remembered.number) {
    kept->process = remembered.process;
    kept->host_ended = remembered.host_ended;
  } else {
    number_ = std::exchange(remembered.number, 0);
    kept = std::move(remembered);
  }
  if (kept->host_ended) restore_events();
  return kept;
}

Result<std::string> WishStore::read_file(const std::string& path, std::size_t most, Duration limit) const {
  PLCHOST_TRY_ASSIGN(auto text, disk_.ask<Result<std::string>>(
                                    limit, path, [path, most] { return read_wish_file(path, most); }));
  return text;
}

// The files that instances read are in the run directory, which a power cut empties.
void WishStore::restore_events() const {
  constexpr std::size_t kMostBytes = std::size_t{1} << 18;  // 4096 names
  const std::string registered = registered_events_path(settings_.run_directory, settings_.instance);
  std::error_code error;
  if (std::filesystem::exists(registered, error)) return;
  const auto kept = read_file(events_path(), kMostBytes, kWishReadLimit);
  if (!kept && kept.error().code == ErrorCode::not_found) return;
  const auto restored = and_then(kept, [&](const auto& text) { return replace_file(registered, text); });
  if (!restored) {
    spdlog::error("instance {}: the events that operators registered are not restored: {}",
                  settings_.instance, restored.error().describe());
  }
}

void WishStore::keep(const InstanceWish& wish) {
  InstanceWish numbered = wish;
  numbered.number = ++number_;
  damaged_ = false;
  const auto remembered = memory_ ? memory_->write(numbered) : Result<void>();
  if (!remembered) {
    spdlog::error("instance {}: its wanted state is not kept for the next manager: {}", settings_.instance,
                  remembered.error().describe());
  }
  std::string contents = encode(wish.after_power_cut());
  std::string text = encode(numbered.after_power_cut());
  if (contents == contents_ || text.size() > kMaxWishBytes) return;
  contents_ = std::move(contents);
  wanted_ = std::move(text);
  write();
}

void WishStore::keep_events() {
  events_wanted_ = true;
  write();
}

void WishStore::when_kept(Kept kept) {
  if (on_disk()) return kept("");
  waiting_.push_back(std::move(kept));
  limit_.set(MonotonicClock::now() + kWishLimit);
  write();
}

void WishStore::write() {
  if (writing_ || on_disk()) return;
  const bool events = wanted_ == written_;
  const WishOrder order =
      events ? WishOrder{.path = events_path(),
                         .text = {},
                         .from = registered_events_path(settings_.run_directory, settings_.instance)}
             : WishOrder{.path = path(), .text = wanted_, .from = {}};
  if (events) events_wanted_ = false;
  writing_ = true;
  const auto begun = writer_.write(order, [this, events, text = order.text](const Result<void>& result) {
    if (events && !result) events_wanted_ = true;
    written(result, events ? written_ : text);
  });
  if (begun) return;
  writing_ = false;
  events_wanted_ = events_wanted_ || events;
  fail(begun.error().describe());
}

void WishStore::written(const Result<void>& result, const std::string& text) {
  writing_ = false;
  if (!result) return fail(result.error().describe());
  written_ = text;
  if (!on_disk()) return write();
  if (!problem_.empty()) {
    spdlog::info("instance {}: its wanted state is on the disk again", settings_.instance);
    problem_.clear();
  }
  retry_.cancel();
  tell("");
}

void WishStore::fail(const std::string& problem) {
  if (problem != problem_) {
    spdlog::error("instance {}: a power cut would undo the last commands of operators: {}",
                  settings_.instance, problem);
    problem_ = problem;
  }
  retry_.set(MonotonicClock::now() + kWishRetry);
  tell(problem);
}

void WishStore::tell(const std::string& problem) {
  limit_.cancel();
  for (const Kept& kept : std::exchange(waiting_, {})) kept(problem);
}

void WishStore::look_after_memory() {
  const auto mended = memory_ ? memory_->mend() : Result<bool>(false);
  if (!mended || *mended) {
    spdlog::error("instance {}: another program has written over the memory of its wish; {}",
                  settings_.instance,
                  mended ? "it is written anew" : "it is lost there: " + mended.error().describe());
  }
  if (!mended) memory_.reset();
}

void WishStore::end() noexcept {
  // A damaged memory tells the next manager that the disk may have an older wish.
  if (on_disk() && !damaged_) WishMemory::remove(settings_.pool, settings_.instance);
}

}  // namespace plchost
