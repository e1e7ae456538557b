#include "instances/runtime/time/system_time.hpp"

#include <algorithm>
#include <bit>

#include <dlfcn.h>
#include <fmt/format.h>
#include <link.h>

#include "shm/base/time.hpp"
#include "shm/log/log.hpp"
#include "shm/process/dynamic_loader.hpp"

namespace plchost {

namespace {

constexpr RTS_SYSTIME kNsPerUs = 1000;

RTS_SYSTIME monotonic_ns() noexcept {
  return static_cast<RTS_SYSTIME>(MonotonicClock::now().time_since_epoch().count());
}

// Null: CLOCK_MONOTONIC. Set before an application is loaded, never changed after.
PF_SYSTIME custom_us = nullptr;
PF_SYSTIME custom_ns = nullptr;

std::unexpected<Error> bad(const TimeFunction& function, std::string_view what) {
  return failure(ErrorCode::invalid_argument, fmt::format("{} {}", function.name, what));
}

// So long both are watched, and no longer than this on a machine that gives us no processor.
constexpr auto kWatched = std::chrono::milliseconds(10);
constexpr auto kWatchedAtMost = std::chrono::seconds(1);

/// One function under test. Each call lies between two stamps of CLOCK_MONOTONIC. However long the processor
/// was taken away, the time that passed from the first to the last value is known to lie between two bounds.
class Watch {
 public:
  Watch(const TimeFunction& function, RTS_SYSTIME ns_per_unit)
      : function_(function), ns_per_unit_(ns_per_unit) {}

  Result<RTS_SYSTIME> read() {
    // The last line of the log, if the call is the end of the process.
    if (!begun_) spdlog::info("[SysTime] first call of {}", function_.name);
    Sample sample;
    sample.before = MonotonicClock::now();
    const RTS_RESULT result = function_.call(&sample.value);
    sample.after = MonotonicClock::now();
    if (result != ERR_OK) return bad(function_, fmt::format("returned {:#06x}, not ERR_OK", result));
    if (begun_ && sample.value < last_.value) {
      return bad(function_, fmt::format("went back from {} to {}", last_.value, sample.value));
    }
    if (!begun_) first_ = sample;
    begun_ = true;
    last_ = sample;
    return sample.value;
  }

  [[nodiscard]] bool is_long_enough() const {
    return passed_at_least() >= kWatched && passed_at_least() * 2 >= passed_at_most();
  }

  // A wrong unit is a factor of 1000, so a factor of 4 is neither that nor the grain of a right clock.
  [[nodiscard]] Result<void> check_pace() const {
    const RTS_SYSTIME advanced = last_.value - first_.value;
    const bool watched = passed_at_least() >= kWatched;
    if (watched && advanced == 0) return bad(function_, fmt::format("stays at {}", last_.value));
    const RTS_SYSTIME least = watched ? units(passed_at_least()) : 0;
    const RTS_SYSTIME most = units(passed_at_most()) + 1;
    if (advanced / 4 > most || advanced < least / 4) {
      return bad(function_, fmt::format("advanced by {} in a time in which CLOCK_MONOTONIC advanced by {}",
                                        advanced, most));
    }
    return {};
  }

 private:
  struct Sample {
    TimePoint before;
    TimePoint after;
    RTS_SYSTIME value = 0;
  };

  [[nodiscard]] Duration passed_at_least() const { return last_.before - first_.after; }
  [[nodiscard]] Duration passed_at_most() const { return last_.after - first_.before; }
  [[nodiscard]] RTS_SYSTIME units(Duration time) const {
    return static_cast<RTS_SYSTIME>(time.count()) / ns_per_unit_;
  }

  TimeFunction function_;
  RTS_SYSTIME ns_per_unit_;
  bool begun_ = false;
  Sample first_;
  Sample last_;
};

/// A function, with what it is called in texts: "MySysTimeGetUs of /opt/clock.so".
struct Found {
  PF_SYSTIME call = nullptr;
  std::string name;
};

// dlsym() finds variables, too, and those must not be called. A function without an entry of its own is the
// one that the function of an IFUNC has chosen.
Result<Found> as_function(void* symbol, const std::string& name, std::span<const PF_SYSTIME> own) {
  Dl_info place{};
  void* entry = nullptr;
  const bool is_placed = ::dladdr1(symbol, &place, &entry, RTLD_DL_SYMENT) != 0;
  const unsigned type =
      entry == nullptr ? STT_FUNC : ELF64_ST_TYPE(static_cast<const ElfW(Sym)*>(entry)->st_info);
  if (!is_placed || (type != STT_FUNC && type != STT_GNU_IFUNC)) {
    return failure(ErrorCode::invalid_argument, fmt::format("[SysTime]: '{}' is no function", name));
  }
  const auto call = std::bit_cast<PF_SYSTIME>(symbol);
  if (std::ranges::find(own, call) != own.end()) {
    return failure(ErrorCode::invalid_argument,
                   fmt::format("[SysTime]: '{}' is the runtime's own and cannot stand for itself", name));
  }
  return Found{call, fmt::format("{} of {}", name, place.dli_fname)};
}

Result<void*> find_in_library(void* library, const std::string& path, const std::string& symbol) {
  void* const found = ::dlsym(library, symbol.c_str());
  if (found != nullptr) return found;
  return failure(ErrorCode::not_found, fmt::format("[SysTime]: {} has no function '{}'", path, symbol));
}

Result<void*> find_in_loaded(const FindSymbol& find_in_components, const std::string& symbol) {
  void* found = find_in_components ? find_in_components(symbol.c_str()) : nullptr;
  if (found == nullptr) found = ::dlsym(RTLD_DEFAULT, symbol.c_str());
  if (found != nullptr) return found;
  return failure(
      ErrorCode::not_found,
      fmt::format("[SysTime]: no component and nothing else that is loaded has a function '{}'; the "
                  "key CustomSysTimeLibrary names the shared object that holds it",
                  symbol));
}

struct Clocks {
  Found us;
  Found ns;
};

template <class Find>
Result<Clocks> find_both(const SysTimeSettings& settings, std::span<const PF_SYSTIME> own, Find find) {
  PLCHOST_TRY_ASSIGN(void* const us_symbol, find(settings.get_us));
  PLCHOST_TRY_ASSIGN(auto us, as_function(us_symbol, settings.get_us, own));
  PLCHOST_TRY_ASSIGN(void* const ns_symbol, find(settings.get_ns));
  PLCHOST_TRY_ASSIGN(auto ns, as_function(ns_symbol, settings.get_ns, own));
  return Clocks{std::move(us), std::move(ns)};
}

Result<Clocks> find_clocks(const SysTimeSettings& settings, std::span<const PF_SYSTIME> own,
                           const FindSymbol& find_in_components) {
  if (settings.library.empty()) {
    return find_both(settings, own,
                     [&](const std::string& symbol) { return find_in_loaded(find_in_components, symbol); });
  }
  // It stays loaded: an application may call it to the very end.
  PLCHOST_TRY_ASSIGN(auto library,
                     in_step("[SysTime] CustomSysTimeLibrary",
                             open_library(settings.library, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE)));
  return find_both(settings, own, [&](const std::string& symbol) {
    return find_in_library(library, settings.library, symbol);
  });
}

RTS_RESULT answer(RTS_SYSTIME* to, PF_SYSTIME custom, RTS_SYSTIME ns_per_unit) noexcept {
  if (to == nullptr) return ERR_PARAMETER;
  if (custom != nullptr) return custom(to);
  *to = monotonic_ns() / ns_per_unit;
  return ERR_OK;
}

}  // namespace

Result<void> check_system_time(const TimeFunction& us, const TimeFunction& ns) {
  Watch us_watch(us, kNsPerUs);
  Watch ns_watch(ns, 1);
  const TimePoint limit = MonotonicClock::now() + kWatchedAtMost;
  do {
    PLCHOST_TRY_ASSIGN(const auto before, ns_watch.read());
    PLCHOST_TRY_ASSIGN(const auto between, us_watch.read());
    PLCHOST_TRY_ASSIGN(const auto after, ns_watch.read());
    if (between + kSystemTimeToleranceUs < before / kNsPerUs ||
        between > after / kNsPerUs + kSystemTimeToleranceUs) {
      return failure(ErrorCode::invalid_argument,
                     fmt::format("{} and {} have no common base: at the same moment {} us and {} ns", us.name,
                                 ns.name, between, before));
    }
  } while (!(ns_watch.is_long_enough() && us_watch.is_long_enough()) && MonotonicClock::now() < limit);
  if (auto paced = ns_watch.check_pace(); !paced) return paced;
  return us_watch.check_pace();
}

Result<void> use_system_time(const SysTimeSettings& settings, std::span<const PF_SYSTIME> own,
                             const FindSymbol& find_in_components) {
  if (settings == SysTimeSettings{}) return {};
  PLCHOST_TRY_ASSIGN(const auto clocks, find_clocks(settings, own, find_in_components));
  const auto& [us, ns] = clocks;
  PLCHOST_TRY(in_step("[SysTime]", check_system_time({us.name, us.call}, {ns.name, ns.call})));
  custom_us = us.call;
  custom_ns = ns.call;
  return {};
}

RTS_RESULT system_time_us(RTS_SYSTIME* to) noexcept {
  return answer(to, custom_us, kNsPerUs);
}

RTS_RESULT system_time_ns(RTS_SYSTIME* to) noexcept {
  return answer(to, custom_ns, 1);
}

}  // namespace plchost
