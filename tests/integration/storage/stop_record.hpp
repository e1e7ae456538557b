#pragma once

#include <string>

#include "api/audit/audit_record.hpp"

namespace plchost {

/// That an operator has stopped the instance.
inline AuditRecord stop_of(const std::string& instance) {
  AuditRecord record;
  record.what = "stop";
  record.on = instance;
  return record;
}

}  // namespace plchost
