#include "shm/library/pool_result.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "shm/plc_pool.h"

namespace plchost {

namespace {

constexpr std::size_t kMaxText = 511;
thread_local std::array<char, kMaxText + 1> last_error{};

void keep(std::string_view text) noexcept {
  const std::size_t size = std::min(text.size(), kMaxText);
  std::copy_n(text.begin(), size, last_error.begin());
  last_error[size] = '\0';
}

int number_of(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::ok:
      return PLC_POOL_OK;
    case ErrorCode::invalid_argument:
      return PLC_POOL_ARGUMENT;
    case ErrorCode::not_found:
      return PLC_POOL_NO_OBJECT;
    case ErrorCode::wrong_type:
      return PLC_POOL_WRONG_TYPE;
    case ErrorCode::wrong_size:
      return PLC_POOL_WRONG_SIZE;
    case ErrorCode::full:
      return PLC_POOL_FULL;
    case ErrorCode::timed_out:
    case ErrorCode::busy:
      return PLC_POOL_TIMED_OUT;
    case ErrorCode::refused:
      return PLC_POOL_REFUSED;
    case ErrorCode::corrupt:
      return PLC_POOL_CORRUPT;
    case ErrorCode::already_exists:
    case ErrorCode::wrong_state:
    case ErrorCode::unavailable:
    case ErrorCode::system:
    case ErrorCode::unsupported:
      break;
  }
  return PLC_POOL_SYSTEM;
}

}  // namespace

int failed(const Error& error) {
  keep(error.describe());
  return number_of(error.code);
}

int argument(std::string_view text) {
  keep(text);
  return PLC_POOL_ARGUMENT;
}

int out_of_order(const char* text) noexcept {
  keep(text);
  return PLC_POOL_SYSTEM;
}

int result_of(ObjectStatus status) noexcept {
  switch (status) {
    case ObjectStatus::done:
      return PLC_POOL_OK;
    case ObjectStatus::timed_out:
      return PLC_POOL_TIMED_OUT;
    case ObjectStatus::owner_died:
      return PLC_POOL_OWNER_DIED;
    case ObjectStatus::deadlock:
      return PLC_POOL_DEADLOCK;
    case ObjectStatus::not_owner:
      return PLC_POOL_NOT_OWNER;
    case ObjectStatus::full:
      return PLC_POOL_FULL;
    case ObjectStatus::not_permitted:
      return PLC_POOL_REFUSED;
    case ObjectStatus::gone:
      return PLC_POOL_GONE;
    case ObjectStatus::bad_cursor:
      return PLC_POOL_ARGUMENT;
    case ObjectStatus::corrupt:
      break;
  }
  return PLC_POOL_CORRUPT;
}

std::string pool_name_of(const char* name) {
  if (name != nullptr) return name;
  const char* const told = std::getenv("PLCHOST_POOL");
  return told != nullptr ? told : "plchost";
}

}  // namespace plchost

const char* plc_pool_error() {
  return plchost::last_error.data();
}

const char* plc_pool_text(int result) {
  switch (result) {
    case PLC_POOL_OK:
      return "ok";
    case PLC_POOL_ALREADY_THERE:
      return "was there already";
    case PLC_POOL_OWNER_DIED:
      return "locked; its owner died";
    case PLC_POOL_ARGUMENT:
      return "argument not allowed";
    case PLC_POOL_NO_OBJECT:
      return "no such object";
    case PLC_POOL_WRONG_TYPE:
      return "wrong type";
    case PLC_POOL_WRONG_SIZE:
      return "wrong size";
    case PLC_POOL_FULL:
      return "full";
    case PLC_POOL_TIMED_OUT:
      return "timed out";
    case PLC_POOL_REFUSED:
      return "refused";
    case PLC_POOL_DEADLOCK:
      return "held by this thread already";
    case PLC_POOL_NOT_OWNER:
      return "not held by this thread";
    case PLC_POOL_GONE:
      return "gone";
    case PLC_POOL_CORRUPT:
      return "corrupt";
    case PLC_POOL_SYSTEM:
      return "system error";
    default:
      return "unknown result";
  }
}
