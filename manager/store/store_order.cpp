#include "manager/store/store_order.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace plchost {

namespace {

using Json = nlohmann::json;

struct OrderText {
  const char* key;
  std::string StoreOrder::* member;
};
constexpr std::array kOrderTexts = {OrderText{"folder", &StoreOrder::folder},
                                    OrderText{"boot", &StoreOrder::boot},
                                    OrderText{"configured", &StoreOrder::configured},
                                    OrderText{"source", &StoreOrder::source},
                                    OrderText{"sha256", &StoreOrder::digest},
                                    OrderText{"name", &StoreOrder::name},
                                    OrderText{"by", &StoreOrder::by},
                                    OrderText{"from", &StoreOrder::from},
                                    OrderText{"before", &StoreOrder::before},
                                    OrderText{"earlier", &StoreOrder::earlier},
                                    OrderText{"trial_group", &StoreOrder::trial_group}};

Result<std::uint64_t> order_number(const Json& json, const char* key, std::uint64_t most) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_number_unsigned() || found->get<std::uint64_t>() > most) {
    return failure(ErrorCode::corrupt, fmt::format("the order has no number '{}'", key));
  }
  return found->get<std::uint64_t>();
}

}  // namespace

std::string encode(const StoreOrder& order) {
  Json json{{"parent", order.parent}, {"size", order.size}, {"keep", order.keep}, {"trial", order.trial}};
  for (const OrderText& text : kOrderTexts) json[text.key] = order.*text.member;
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<StoreOrder> decode_store_order(std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return failure(ErrorCode::corrupt, "the order is not a JSON object");
  StoreOrder order;
  for (const OrderText& member : kOrderTexts) {
    const auto found = json.find(member.key);
    if (found == json.end() || !found->is_string()) {
      return failure(ErrorCode::corrupt, fmt::format("the order has no text '{}'", member.key));
    }
    order.*member.member = found->get<std::string>();
  }
  PLCHOST_TRY_ASSIGN(const auto size, order_number(json, "size", std::numeric_limits<std::uint64_t>::max()));
  PLCHOST_TRY_ASSIGN(const auto keep, order_number(json, "keep", std::numeric_limits<std::uint32_t>::max()));
  PLCHOST_TRY_ASSIGN(const auto parent,
                     order_number(json, "parent", std::numeric_limits<std::int32_t>::max()));
  const auto trial = json.find("trial");
  if (trial == json.end() || !trial->is_array() ||
      !std::ranges::all_of(*trial, [](const Json& argument) { return argument.is_string(); })) {
    return failure(ErrorCode::corrupt, "the order has no command line 'trial'");
  }
  order.trial = trial->get<std::vector<std::string>>();
  order.parent = static_cast<pid_t>(parent);
  order.size = size;
  order.keep = static_cast<std::uint32_t>(keep);
  return order;
}

}  // namespace plchost
