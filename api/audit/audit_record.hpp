#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "shm/base/result.hpp"

namespace plchost {

/// A client, its command and the result.
struct AuditRecord {
  std::int64_t time_unix_ns = 0;
  std::string who;   ///< the identity that DDS Security has proven; "" if there is none
  std::string from;  ///< the client's own words about itself: program, user, machine; and its participant
  std::string what;  ///< the operation: "stop", "post"; or "begin", "repair", "gap": of the log itself
  std::string on;    ///< the instance; "": the host
  std::string argument;
  std::string result;  ///< "ok", or the name of the error
  std::string text;    ///< why it failed, or a remark
};

/// Where a chain of records has come to.
struct AuditHead {
  std::uint64_t number = 0;  ///< of the last record; the first one has 1
  std::string hash = std::string(64, '0');
};

/// The record that follows `head` as a line of JSON with a newline, and `head` moved on to it. The
/// field "before" is the hash of the record before. "hash" is the SHA-256 of the line up to its comma. Texts
/// that are no UTF-8 are made so.
[[nodiscard]] std::string chain(const AuditRecord& record, AuditHead& head);

/// The part of a line (without its newline) that is about the chain.
struct AuditLink {
  std::uint64_t number = 0;
  std::string before;
  std::string hash;
  std::string what;
};
/// corrupt: it is no record, or its hash is not its own. Says what is wrong.
[[nodiscard]] Result<AuditLink> read_link(std::string_view line);

}  // namespace plchost
