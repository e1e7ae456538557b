#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <string_view>

#include <sys/types.h>

#include "shm/pool/pool_layout.hpp"

namespace plchost {

/// The seed's objTabType_t, with the same numbers, and a type that it does not have.
enum class ObjectType : std::uint32_t { memory = 0, semaphore = 1, event = 2, mutex = 3 };
inline constexpr std::uint32_t kObjectTypes = 4;

/// The traits of one type of objects: a row of kObjectTraits.
struct ObjectTraits {
  ObjectType type;
  std::string_view name;        ///< for people and in queries: "semaphore"
  std::string_view value_form;  ///< how a value is told; {}: the number
  /// Bounds of the initial value. Of a memory it is the size in bytes.
  std::uint64_t least_initial;
  std::uint64_t most_initial;
  /// Gives a new entry its initial value. Set-up, with the mutex held, before others find the entry.
  void (*begin)(ObjectEntry& entry, std::uint64_t initial) noexcept;
  /// The value that lists show; 0 of a memory, whose size they show. Any context.
  std::uint64_t (*value)(const ObjectEntry& entry) noexcept;
};

/// By the numbers of the types.
inline constexpr std::array<ObjectTraits, kObjectTypes> kObjectTraits{
    {{.type = ObjectType::memory,
      .name = "memory",
      .value_form = "{} bytes",
      .least_initial = 1,
      .most_initial = static_cast<std::uint64_t>(std::numeric_limits<off_t>::max()),
      .begin = [](ObjectEntry& entry, std::uint64_t bytes) noexcept { entry.size.store(bytes, kRelaxed); },
      .value = [](const ObjectEntry& /*entry*/) noexcept { return std::uint64_t{0}; }},
     {.type = ObjectType::semaphore,
      .name = "semaphore",
      .value_form = "value {}",
      .least_initial = 0,
      .most_initial = CountingSemaphore::kMaxValue,
      .begin =
          [](ObjectEntry& entry, std::uint64_t units) noexcept {
            new (&entry.semaphore) CountingSemaphore(static_cast<std::uint32_t>(units));
          },
      .value = [](const ObjectEntry& entry) noexcept { return std::uint64_t{entry.semaphore.value()}; }},
     {.type = ObjectType::event,
      .name = "event",
      .value_form = "{} posts",
      .least_initial = 0,
      .most_initial = 0,
      .begin = [](ObjectEntry& entry,
                  std::uint64_t /*none*/) noexcept { entry.binding.fetch_or(Binding::kRegistered); },
      .value =
          [](const ObjectEntry& entry) noexcept {
            return (entry.event.count() - entry.first_count.load(kRelaxed)) & CountedEvent::kCountMask;
          }},
     {.type = ObjectType::mutex,
      .name = "mutex",
      .value_form = "held by thread {}",
      .least_initial = 0,
      .most_initial = 0,
      .begin = [](ObjectEntry& entry, std::uint64_t /*none*/) noexcept { new (&entry.mutex) RobustMutex(); },
      .value = [](const ObjectEntry& entry) noexcept { return std::uint64_t{entry.mutex.owner()}; }}}};

/// Null: a newer host's type, or a stranger's number.
[[nodiscard]] constexpr const ObjectTraits* traits_of(ObjectType type) noexcept {
  const auto number = static_cast<std::size_t>(type);
  return number < kObjectTraits.size() ? &kObjectTraits.at(number) : nullptr;
}

[[nodiscard]] constexpr std::string_view to_string(ObjectType type) noexcept {
  const ObjectTraits* const traits = traits_of(type);
  return traits == nullptr ? std::string_view("unknown") : traits->name;
}

namespace detail {
[[nodiscard]] consteval bool are_by_number() {
  for (std::size_t number = 0; number < kObjectTraits.size(); ++number) {
    if (static_cast<std::size_t>(kObjectTraits.at(number).type) != number) return false;
  }
  return true;
}
}  // namespace detail
static_assert(detail::are_by_number());

}  // namespace plchost
