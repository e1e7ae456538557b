#include "instances/runtime/memory/retain_keeper.hpp"

#include <algorithm>
#include <bitset>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "instances/launch/launch_contract.hpp"
#include "instances/runtime/settings/read_settings.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// The common areas of two layouts, for people.
std::string describe_difference(const RetainLayout& kept, const RetainLayout& wanted) {
  if (kept.application != wanted.application) {
    return fmt::format("they are those of application '{}'", kept.application);
  }
  for (const RetainArea& area : wanted.areas) {
    const auto other = std::ranges::find(kept.areas, area.name, &RetainArea::name);
    if (other == kept.areas.end()) return fmt::format("they have no area '{}'", area.name);
    if (other->bytes != area.bytes) {
      return fmt::format("area '{}' has {} bytes in them and {} now", area.name, other->bytes, area.bytes);
    }
    if (other->layout != area.layout) return fmt::format("area '{}' has another layout in them", area.name);
  }
  return kept.areas.size() > wanted.areas.size() ? "they have more areas"
                                                 : "their areas have other flags or places";
}

}  // namespace

/// How it begins.
struct RetainKeeper::Start {
  std::optional<RetainFiles> files;
  std::optional<RetainImage> source;  // the values to go on with
  Origin origin = PLC_AREA_INITIAL;   // of those
  std::bitset<2> aside;               // files that are damaged, or of another layout
  std::uint64_t generation = 0;       // the highest that was used
  std::vector<std::byte> written;     // the contents of the newest file
  RetainImage image;                  // the wanted contents of the memory
  std::vector<Origin> origins;
  std::vector<std::string> remarks;

  Result<void> open_files(const Options& options, const std::string& instance) {
    if (options.directory.empty()) {
      remarks.emplace_back(
          "retain variables are lost when the power is cut: no folder for them is given ([Retain] Directory, "
          "or "
          "state_directory of the manager)");
      return {};
    }
    PLCHOST_TRY_ASSIGN(auto opened, RetainFiles::open(options.directory, instance));
    files.emplace(std::move(opened));
    return {};
  }

  // The memory of a process that was not ended by the power is newer than any file that it wrote.
  void find_source(const std::string& pool, const std::string& name, RetainFiles::Found found) {
    auto left = pool.empty() ? Result<RetainMemory::Left>(failure(ErrorCode::not_found, name))
                             : RetainMemory::left_behind(pool, name);
    if (!left && left.error().code != ErrorCode::not_found) {
      remarks.push_back(fmt::format("the retain memory that the process before has left is not used: {}",
                                    left.error().describe()));
    }
    for (std::string& problem : found.problems) remarks.push_back(std::move(problem));
    aside = found.damaged;
    if (found.newest) {
      generation = found.newest->generation;
      written = found.newest->data;
    }
    if (left && left->image.generation >= generation) {
      if (left->in_cycle > 0) {
        remarks.push_back("the process before ended within the cycles of " +
                          count_text(left->in_cycle, "task"));
      }
      generation = left->image.generation;
      origin = PLC_AREA_RETAINED;
      source = std::move(left->image);
    } else if (found.newest) {
      origin = PLC_AREA_RESTORED;
      source = std::move(found.newest);
    }
  }

  Result<void> judge(const RetainLayout& wanted, RetainMismatch mismatch) {
    if (!source || source->layout == wanted) return {};
    const std::string why = fmt::format("the retain values are of another layout: {}",
                                        describe_difference(source->layout, wanted));
    switch (mismatch) {
      case RetainMismatch::refuse:
        return failure(ErrorCode::refused,
                       why +
                           "; [Retain] Mismatch=Initialise or Ignore would load it, or remove "
                           "the files");
      case RetainMismatch::initialise:
        remarks.push_back(why + ": all begin with their initial values; the files are put aside as .old");
        aside.set();
        source.reset();
        break;
      case RetainMismatch::ignore:
        remarks.push_back(why + ": areas of the same name have their bytes, as many as both have");
        break;
    }
    return {};
  }

  void fill(const RetainImage& initial, bool cold) {
    image = initial;
    image.generation = generation;
    origins.assign(initial.layout.areas.size(), PLC_AREA_INITIAL);
    if (!source) return;
    for (std::size_t i = 0; i < origins.size(); ++i) {
      const RetainArea& area = initial.layout.areas[i];
      if (cold && (area.flags & PLC_AREA_PERSISTENT) == 0) continue;
      const auto old = std::ranges::find(source->layout.areas, area.name, &RetainArea::name);
      if (old == source->layout.areas.end()) continue;
      std::copy_n(source->data.begin() + static_cast<std::ptrdiff_t>(old->offset),
                  std::min(old->bytes, area.bytes),
                  image.data.begin() + static_cast<std::ptrdiff_t>(area.offset));
      origins[i] = origin;
    }
  }

  [[nodiscard]] bool goes_on_in_place(const RetainImage& initial, bool cold) const {
    return origin == PLC_AREA_RETAINED && source && source->layout == initial.layout && !cold;
  }
};

Result<std::size_t> RetainKeeper::check(const std::string& pool, const std::string& instance,
                                        const RetainImage& initial, const Options& options) {
  Start start;
  const bool files = !options.directory.empty();
  start.find_source(pool, retain_memory_name(instance),
                    files ? RetainFiles::look(options.directory, instance) : RetainFiles::Found{});
  PLCHOST_TRY(start.judge(initial.layout, options.mismatch));
  if (start.goes_on_in_place(initial, options.cold)) return 0;
  return RetainMemory::bytes_for(initial.layout.bytes);
}

Result<std::unique_ptr<RetainKeeper>> RetainKeeper::make(ObjectPool& pool, const std::string& instance,
                                                         const RetainImage& initial, const Options& options) {
  const std::string name = retain_memory_name(instance);
  Start start;
  PLCHOST_TRY(start.open_files(options, instance));
  start.find_source(pool.name(), name, start.files ? start.files->read() : RetainFiles::Found{});
  PLCHOST_TRY(start.judge(initial.layout, options.mismatch));
  start.fill(initial, options.cold);
  auto memory = start.goes_on_in_place(initial, options.cold)
                    ? RetainMemory::take_over(pool, name, initial.layout)
                    : RetainMemory::prepare(pool, name, start.image);
  // The left-over may be a file without an object: then its values go on in a new one.
  if (!memory) memory = RetainMemory::prepare(pool, name, start.image);
  PLCHOST_TRY(memory);
  return std::unique_ptr<RetainKeeper>(
      new RetainKeeper(pool, name, *std::move(memory), std::move(start), options));
}

Result<void> RetainKeeper::start() {
  // The thread waits: the steps that can fail come before those that change anything.
  if (files_) {
    PLCHOST_TRY_ASSIGN(thread_, Thread::start("retain", {}, [this] { run(); }));
  }
  // Before the memory of then is replaced: a start after a kill finds nothing to put aside.
  if (files_) put_aside(aside_);
  if (auto published = memory_.publish(pool_, name_); !published) return published;
  save_first();
  const std::lock_guard lock(mutex_);
  started_ = true;
  wake_.notify_one();
  return {};
}

RetainKeeper::RetainKeeper(ObjectPool& pool, std::string name, RetainMemory memory, Start start,
                           const Options& options)
    : pool_(pool),
      name_(std::move(name)),
      memory_(std::move(memory)),
      aside_(start.aside),
      files_(std::move(start.files)),
      origins_(std::move(start.origins)),
      remarks_(std::move(start.remarks)),
      interval_(options.interval),
      postpone_(options.postpone),
      image_(std::move(start.image)),
      scratch_(image_.data.size()),
      written_(std::move(start.written)) {}

void RetainKeeper::save_soon() {
  const std::lock_guard lock(mutex_);
  soon_ = true;
  wake_.notify_one();
}

void RetainKeeper::finish() {
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(ending_, true)) return;
    wake_.notify_one();
  }
  thread_.join();
}

// Between two saves it looks whether there will be something to save.
void RetainKeeper::run() {
  constexpr Duration kBetweenLooks = std::chrono::seconds(1);
  const auto awaited = [this] { return soon_ || ending_; };
  std::unique_lock lock(mutex_);
  wake_.wait(lock, [this] { return started_ || ending_; });
  for (bool last = !started_; !last;) {
    const TimePoint next = MonotonicClock::now() + interval_;
    for (Duration left = interval_; left > Duration::zero() && !awaited();
         left = next - MonotonicClock::now()) {
      wake_.wait_for(lock, std::min(left, kBetweenLooks), awaited);
      lock.unlock();
      (void)notice_loss();
      lock.lock();
    }
    soon_ = false;
    last = ending_;
    lock.unlock();
    save();
    lock.lock();
  }
}

// Cycles are short and rest in between: a moment without any comes soon, if it comes at all.
bool RetainKeeper::take_whole() {
  constexpr auto kPause = std::chrono::microseconds(250);
  const TimePoint deadline = MonotonicClock::now() + postpone_;
  while (!memory_.snapshot(scratch_)) {
    if (MonotonicClock::now() >= deadline) return false;
    std::this_thread::sleep_for(kPause);
  }
  image_.data.swap(scratch_);
  return true;
}

bool RetainKeeper::rest() {
  constexpr auto kPause = std::chrono::milliseconds(1);
  std::unique_lock lock(mutex_);
  return !wake_.wait_for(lock, kPause, [this] { return ending_; });
}

// Tasks copy what they alone change, each at the end of a cycle. No task waits for the others: data that one
// of them has not given until then stay as they were.
RetainKeeper::Taken RetainKeeper::take_groups() {
  constexpr auto kPatience = std::chrono::seconds(2);
  std::deque<RetainGroup>& groups = memory_.groups();
  if (groups.empty()) return Taken::none;
  for (RetainGroup& group : groups) group.ask(scratch_);
  const auto all_answered = [&] {
    const auto count = std::ranges::count_if(groups, [](RetainGroup& group) { return group.is_answered(); });
    return static_cast<std::size_t>(count) == groups.size();
  };
  const TimePoint deadline = MonotonicClock::now() + kPatience;
  while (!all_answered() && MonotonicClock::now() < deadline && rest()) {
  }
  std::size_t answered = 0;
  for (RetainGroup& group : groups) {
    if (!group.withdraw()) continue;
    ++answered;
    for (const auto& [offset, live] : group.parts()) {
      std::copy_n(scratch_.begin() + static_cast<std::ptrdiff_t>(offset), live.size(),
                  image_.data.begin() + static_cast<std::ptrdiff_t>(offset));
    }
  }
  if (answered == 0) return Taken::none;
  memory_.copy_elsewhere(image_.data);
  return answered == groups.size() ? Taken::all : Taken::some;
}

RetainKeeper::Taken RetainKeeper::take_snapshot() {
  return take_whole() ? Taken::all : take_groups();
}

bool RetainKeeper::notice_loss() {
  lost_ = lost_ || !memory_.is_whole();
  if (lost_) {
    tell(Fault::memory,
         "another program has cut or overwritten the memory in which they lie; reset the instance, which "
         "takes "
         "them from the file");
  }
  return lost_;
}

// The decision for this start holds also if the power is cut now. If the disk refuses it, the machine runs
// all the same.
void RetainKeeper::save_first() {
  if (!files_) return;
  if (notice_loss()) return count_unsaved();
  if (write_image()) saves_.store(1, std::memory_order_relaxed);
}

void RetainKeeper::save() {
  // A lost memory stays lost: its contents are not known if it looks whole again later.
  if (lost_) return count_unsaved();
  const Taken taken = take_snapshot();
  if (notice_loss()) return count_unsaved();
  tell(Fault::cycles,
       taken == Taken::all ? ""
       : taken == Taken::none
           ? "the tasks were always in a cycle, or a debugger halts one; raise [Retain] PostponeMs"
           : "the tasks of some areas were always in a cycle, or a debugger halts one; raise "
             "[Retain] PostponeMs");
  if (taken != Taken::all) count_unsaved();
  if (taken == Taken::none || (image_.data == written_ && saves() > 0)) return;
  if (write_image() && taken == Taken::all) saves_.store(saves() + 1, std::memory_order_relaxed);
}

bool RetainKeeper::write_image() {
  const auto done = write();
  tell(Fault::files, done ? "" : done.error().describe());
  if (done) {
    written_ = image_.data;
  } else {
    count_unsaved();
  }
  return done.has_value();
}

// An attempt that fails is repeated under the same number: so it never takes the place of the last good file.
Result<void> RetainKeeper::write() {
  if (!files_->held()) {
    if (auto taken = files_->take(); !taken) return taken;
    put_strange_files_aside();
  }
  ++image_.generation;
  image_.unix_ns = unix_time_ns();
  // Before the file: memory that says less than a file would be taken for older.
  memory_.set_generation(image_.generation);
  auto done = files_->write(image_);
  if (!done) --image_.generation;
  return done;
}

// The folder could not be used at the start, and has come with files whose values were not loaded then.
void RetainKeeper::put_strange_files_aside() {
  const auto found = files_->read();
  if (!found.newest || found.newest->generation <= image_.generation) return;
  spdlog::warn(
      "retain variables: files were found that could not be read at the start; they are put aside as .old");
  put_aside(std::bitset<2>().set());
  image_.generation = found.newest->generation;
}

// A disk that does not take the copies keeps no machine from its start.
void RetainKeeper::put_aside(std::bitset<2> which) const {
  if (const auto done = files_->put_aside(which); !done)
    spdlog::warn("retain variables: the files of before are not put aside: {}", done.error().describe());
}

void RetainKeeper::count_unsaved() noexcept {
  unsaved_.store(unsaved() + 1, std::memory_order_relaxed);
}

// Each kind of fault by itself, so that two of them at a time are not told in turns for ever.
void RetainKeeper::tell(Fault fault, std::string why) {
  const std::lock_guard lock(mutex_);
  std::string& known = problems_[std::to_underlying(fault)];
  if (why == known) return;
  known = std::move(why);
  if (!known.empty()) {
    spdlog::warn("retain variables are not written: {}. The file has their values from before", known);
  } else if (std::ranges::all_of(problems_, &std::string::empty)) {
    spdlog::info("retain variables are written again");
  }
}

std::string RetainKeeper::problem() const {
  const std::lock_guard lock(mutex_);
  const auto worst = std::ranges::find_if_not(problems_, &std::string::empty);
  return worst == problems_.end() ? std::string() : "retain variables are not written: " + *worst;
}

namespace {

Result<std::string> directory_of(const LaunchOptions& launch) {
  if (launch.settings.empty()) return launch.state_directory;
  PLCHOST_TRY_ASSIGN(const auto settings, read_settings(launch.settings));
  const std::string& own = settings.retain.directory;
  return own.empty() ? launch.state_directory : own;
}

}  // namespace

Result<void> save_left_behind(const LaunchOptions& launch) {
  auto left = RetainMemory::left_behind(launch.pool, retain_memory_name(launch.name));
  if (!left && left.error().code == ErrorCode::not_found) return {};
  // A damaged memory is worth nothing: the files hold the last good values.
  if (!left && left.error().code == ErrorCode::corrupt) {
    spdlog::warn("retain variables: the values that are left in memory are not written: {}",
                 left.error().describe());
    return {};
  }
  PLCHOST_TRY(left);
  PLCHOST_TRY_ASSIGN(const auto directory, directory_of(launch));
  if (directory.empty()) return failure(ErrorCode::not_found, "no folder for retain variables is given");
  PLCHOST_TRY_ASSIGN(auto files, RetainFiles::open(directory, launch.name));
  const auto found = files.read();
  RetainImage& image = left->image;
  if (found.newest) {
    const bool newer = found.newest->generation > image.generation;
    if (newer || (found.newest->layout == image.layout && found.newest->data == image.data)) return {};
  }
  if (left->in_cycle > 0) {
    spdlog::warn("retain variables: the process ended within the cycles of {}",
                 count_text(left->in_cycle, "task"));
  }
  ++image.generation;
  image.unix_ns = unix_time_ns();
  return files.write(image);
}

}  // namespace plchost
