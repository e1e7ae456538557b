#pragma once

#include <exception>
#include <string>
#include <string_view>

#include "shm/base/result.hpp"
#include "shm/pool/pool_object.hpp"

namespace plchost {

/// The result of the C API for a failure, whose text plc_pool_error() then gives.
int failed(const Error& error);
/// PLC_POOL_ARGUMENT, with that text.
int argument(std::string_view text);
/// PLC_POOL_SYSTEM, with that text; never throws.
int out_of_order(const char* text) noexcept;

/// Of an operation on an object. Any context.
[[nodiscard]] int result_of(ObjectStatus status) noexcept;

/// The name that plc_pool_open means.
[[nodiscard]] std::string pool_name_of(const char* name);

/// For set-up calls: an exception thrown within becomes a result.
template <class Call>
int guarded(Call call) noexcept {
  try {
    return call();
  } catch (const std::exception& thrown) {
    return out_of_order(thrown.what());
  }
}

}  // namespace plchost
