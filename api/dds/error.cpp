#include "api/dds/error.hpp"

#include <fmt/format.h>

namespace plchost::dds {

namespace {

std::unexpected<Error> refused(dds_return_t returned, const std::string& step) {
  if (returned == DDS_RETCODE_NOT_ALLOWED_BY_SECURITY) {
    return failure(ErrorCode::refused,
                   fmt::format("{}: the permissions of this identity do not allow it", step));
  }
  const ErrorCode code = returned == DDS_RETCODE_TIMEOUT ? ErrorCode::timed_out : ErrorCode::system;
  return failure(code, fmt::format("{}: DDS says '{}'", step, dds_strretcode(-returned)));
}

}  // namespace

Result<Entity> check_entity(dds_entity_t returned, const std::string& step) {
  if (returned < 0) return refused(returned, step);
  return Entity(returned);
}

Result<void> check_code(dds_return_t returned, const std::string& step) {
  if (returned < 0) return refused(returned, step);
  return {};
}

}  // namespace plchost::dds
