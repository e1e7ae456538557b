#include "instances/runtime/debug/debug_answer.hpp"

#include <nlohmann/json.hpp>

namespace plchost {

std::string debug_answer(nlohmann::json answer) {
  const auto text = [&] { return answer.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace); };
  if (text().size() > kMaxDebugAnswer) answer.erase("file");
  if (text().size() > kMaxDebugAnswer)
    answer["remark"] = "breakpoints are ignored in tasks of external events under this scheduler";
  return text();
}

}  // namespace plchost
