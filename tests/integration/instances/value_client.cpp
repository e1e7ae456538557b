#include "tests/integration/instances/value_client.hpp"

#include <gtest/gtest.h>

#include "tests/support/receive_until.hpp"

namespace plchost::testing {

ValueClient::ValueClient(const Sandbox& sandbox) : sandbox_(sandbox) {
  const bool connected = eventually([&] {
    auto socket = PacketSocket::connect(values_socket_path(sandbox.folder(), "line1"));
    if (socket) socket_ = *std::move(socket);
    return socket.has_value();
  });
  EXPECT_TRUE(connected);
  open_table();
}

void ValueClient::open_table() {
  auto table = SymbolTable::open(sandbox_.pool(), "line1");
  table_ = table ? *std::move(table) : SymbolTable({}, 0);
}

std::vector<VariableElement> ValueClient::elements(const std::vector<std::string>& names) const {
  std::vector<VariableElement> elements;
  for (const std::string& name : names) {
    const auto element = table_->find(name);
    EXPECT_TRUE(element) << element.error().message;
    elements.push_back(element.value_or(VariableElement{}));
  }
  return elements;
}

void ValueClient::send(const std::vector<VariableElement>& elements, ValueKind kind) {
  const auto sent = socket_.send(encode(
      ValueRequest{.number = ++number_, .stream = table_->stream(), .kind = kind, .elements = elements}));
  EXPECT_TRUE(sent) << sent.error().describe();
}

std::optional<ValueReply> ValueClient::receive() {
  for (;;) {
    const auto packet = receive_until(socket_, MonotonicClock::now() + std::chrono::seconds(20));
    if (!packet) return std::nullopt;
    auto reply = reader_.take(*packet);
    EXPECT_TRUE(reply) << reply.error().describe();
    if (!reply) return std::nullopt;
    if (*reply) return *std::move(*reply);
  }
}

ValueReply ValueClient::ask(const std::vector<VariableElement>& elements, ValueKind kind) {
  send(elements, kind);
  auto reply = receive();
  EXPECT_TRUE(reply);
  if (!reply) return {.code = ErrorCode::unavailable};
  EXPECT_EQ(reply->number, number_);
  return *std::move(reply);
}

std::vector<std::string> ValueClient::texts(const ValueReply& reply) const {
  std::vector<std::string> texts;
  std::span<const std::byte> values = reply.values;
  for (const VariableElement element : reply.elements) {
    const VariableSymbol& symbol = table_->symbols()[element.symbol];
    texts.push_back(variable_text(symbol.type, values.first(symbol.bytes)));
    values = values.subspan(symbol.bytes);
  }
  EXPECT_TRUE(values.empty());
  return texts;
}

std::string ValueClient::read(const std::string& name) {
  const ValueReply reply = ask(elements({name}));
  return reply.code == ErrorCode::ok ? texts(reply).at(0) : std::string(to_string(reply.code));
}

}  // namespace plchost::testing
