#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "api/audit/audit_check.hpp"

// Any text is a log with or without problems; and what the log itself writes, of whatever texts, has none.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace plchost;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  AuditFindings strange;
  AuditWalk stranger(strange);
  AuditFindings own;
  AuditWalk walk(own);
  AuditHead head;
  for (std::string_view rest = text; !rest.empty();) {
    const std::size_t end = rest.find('\n');
    const std::string_view line = rest.substr(0, end);
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
    stranger.take("line", line);
    AuditRecord record;
    record.from = line;
    record.argument = line;
    std::string written = chain(record, head);
    written.pop_back();
    walk.take("line", written);
  }
  stranger.end();
  walk.end();
  if (!own.problems.empty() || own.head.hash != head.hash) std::abort();
  return 0;
}
