#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost {

/// The seed's objTabType_t, with the same numbers, and a type that it does not have.
enum class ObjectType : std::uint32_t { memory = 0, semaphore = 1, event = 2, mutex = 3 };
inline constexpr std::uint32_t kObjectTypes = 4;
[[nodiscard]] std::string_view to_string(ObjectType type) noexcept;

/// Whether an object may have this name: 1 to kMaxObjectName bytes of UTF-8 without control characters.
[[nodiscard]] bool is_object_name(std::string_view name) noexcept;
/// The same; invalid_argument says what is allowed.
[[nodiscard]] Result<void> check_object_name(std::string_view name);

}  // namespace plchost
