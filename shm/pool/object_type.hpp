#pragma once

#include <cstdint>
#include <string_view>

namespace plchost {

/// The seed's objTabType_t, with the same numbers, and a type that it does not have.
enum class ObjectType : std::uint32_t { memory = 0, semaphore = 1, event = 2, mutex = 3 };
inline constexpr std::uint32_t kObjectTypes = 4;
[[nodiscard]] std::string_view to_string(ObjectType type) noexcept;

}  // namespace plchost
