#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include "instances/runtime/settings/settings_key.hpp"
#include "schedulers/settings/scheduler_settings.hpp"
#include "schedulers/settings/task_options.hpp"
#include "shm/base/bounds.hpp"

// The values of the rows of settings_*.cpp, made from members of the settings: where a value goes, and its
// default, which is the one of the struct.

namespace plchost {

namespace detail {
template <class Struct, class First, class... Rest>
constexpr auto& member_of(Struct& of, First first, Rest... rest) {
  if constexpr (sizeof...(Rest) == 0) {
    return of.*first;
  } else {
    return member_of(of.*first, rest...);
  }
}
}  // namespace detail

/// A member of InstanceSettings, by the path to it.
template <auto... kPath>
struct At {
  using Value = std::remove_cvref_t<decltype(detail::member_of(std::declval<InstanceSettings&>(), kPath...))>;
  static void put(const SettingsTarget& to, Value value) {
    detail::member_of(to.settings, kPath...) = std::move(value);
  }
  static Value initial() {
    const InstanceSettings settings;
    return detail::member_of(settings, kPath...);
  }
};

/// An option of a task: a member of TaskSettings. The default is that of TaskOptions, by the path in it.
template <auto kOption, auto... kPath>
struct AtTask {
  using Value = std::remove_cvref_t<decltype(detail::member_of(std::declval<TaskOptions&>(), kPath...))>;
  static void put(const SettingsTarget& to, Value value) { to.task->*kOption = value; }
  static Value initial() {
    const TaskOptions task;
    return detail::member_of(task, kPath...);
  }
};

// How a number of the file stands in a member.

struct AsNumber {
  template <class Value>
  static Value value(std::int64_t number) {
    return static_cast<Value>(number);
  }
  template <class Value>
  static constexpr std::int64_t number(Value value) {
    return static_cast<std::int64_t>(value);
  }
};

/// 1 is false.
struct AsOpposite {
  template <class Value>
  static Value value(std::int64_t number) {
    return number == 0;
  }
  static constexpr std::int64_t number(bool value) { return value ? 0 : 1; }
};

template <class Unit>
struct As {
  template <class Value>
  static Value value(std::int64_t number) {
    return Unit(number);
  }
  static constexpr std::int64_t number(Duration value) {
    return std::chrono::duration_cast<Unit>(value).count();
  }
};

namespace detail {
// The range of a setting of the schedulers. One without a row in kSettingRanges does not compile.
template <class Place>
struct OfSchedulers : std::false_type {};
template <auto... kPath>
struct OfSchedulers<At<&InstanceSettings::scheduler, kPath...>> : std::true_type {
  static constexpr const auto& range() { return std::get<SettingRange<kPath...>>(kSettingRanges).in_files; }
};

template <class Place, class Form>
void put_number(const SettingsTarget& to, std::int64_t number) {
  Place::put(to, Form::template value<typename Place::Value>(number));
}
template <class Place, class Form>
std::int64_t initial_number() {
  return Form::number(Place::initial());
}
}  // namespace detail

namespace detail {
template <class Place, class Form>
constexpr NumberSetting number_within(std::int64_t lowest, std::int64_t highest, bool capped) {
  return {.lowest = lowest,
          .highest = highest,
          .apply = &detail::put_number<Place, Form>,
          .initial = &detail::initial_number<Place, Form>,
          .capped = capped};
}
}  // namespace detail

template <class Place, class Form = AsNumber>
constexpr NumberSetting number_setting(std::int64_t lowest, std::int64_t highest, bool capped = false) {
  static_assert(!detail::OfSchedulers<Place>::value,
                "a setting of the schedulers has its range in kSettingRanges");
  return detail::number_within<Place, Form>(lowest, highest, capped);
}

/// A setting of the schedulers: its range stands in kSettingRanges.
template <class Place, class Form = AsNumber>
constexpr NumberSetting number_setting(bool capped = false) {
  constexpr auto kRange = detail::OfSchedulers<Place>::range();
  return detail::number_within<Place, Form>(Form::number(kRange.lowest), Form::number(kRange.highest),
                                            capped);
}

template <class Place, class Form = AsNumber, class Value>
constexpr NumberSetting number_setting(const Bounds<Value>& bounds, bool capped = false) {
  return number_setting<Place, Form>(Form::number(bounds.lowest), Form::number(bounds.highest), capped);
}

/// 0 is off, 1 is on.
template <class Place, class Form = AsNumber>
constexpr NumberSetting truth_setting() {
  return detail::number_within<Place, Form>(0, 1, false);
}

/// In the member 0 is "not set".
template <class Place, class Form = AsNumber>
constexpr OptionalNumberSetting optional_number_setting() {
  return {.highest = Form::number(detail::OfSchedulers<Place>::range().highest),
          .apply = [](const SettingsTarget& to,
                      std::int64_t given) { detail::put_number<Place, Form>(to, given < 0 ? 0 : given); },
          .initial = &detail::initial_number<Place, Form>};
}

template <class Place>
constexpr MicrosecondSetting microsecond_setting() {
  using Us = As<std::chrono::microseconds>;
  constexpr Bounds<Duration> kRange = detail::OfSchedulers<Place>::range();
  return {.lowest = Us::number(kRange.lowest),
          .highest = Us::number(kRange.highest),
          .apply = &Place::put,
          .initial = &Place::initial};
}

/// `words` in the order of the enumerators.
template <class Place>
constexpr WordSetting word_setting(std::span<const std::string_view> words) {
  return {.words = words,
          .apply = [](const SettingsTarget& to,
                      std::size_t index) { Place::put(to, static_cast<typename Place::Value>(index)); },
          .initial = [] { return static_cast<std::size_t>(Place::initial()); }};
}

template <class Place>
constexpr TextSetting text_setting(std::string_view form, bool (*allows)(std::string_view text)) {
  return {
      .form = form,
      .allows = allows,
      .apply = [](const SettingsTarget& to, std::string_view given) { Place::put(to, std::string(given)); },
      .initial = &Place::initial};
}

}  // namespace plchost
