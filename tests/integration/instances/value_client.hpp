#pragma once

#include <optional>
#include <string>
#include <vector>

#include "shm/sockets/packet_socket.hpp"
#include "shm/variables/symbol_page.hpp"
#include "shm/variables/value_message.hpp"
#include "tests/integration/instances/instance_process.hpp"

namespace plchost::testing {

/// Reads the variables of "line1" as the API server does.
class ValueClient {
 public:
  explicit ValueClient(const Sandbox& sandbox);

  /// Opens the table anew.
  void open_table();
  [[nodiscard]] const SymbolTable& table() const { return *table_; }
  [[nodiscard]] std::vector<VariableElement> elements(const std::vector<std::string>& names) const;
  void send(const std::vector<VariableElement>& elements, ValueKind kind = ValueKind::current);
  /// Nothing: the connection is over, or there is no answer in time.
  [[nodiscard]] std::optional<ValueReply> receive();
  [[nodiscard]] ValueReply ask(const std::vector<VariableElement>& elements,
                               ValueKind kind = ValueKind::current);
  /// The texts of the values of a reply.
  [[nodiscard]] std::vector<std::string> texts(const ValueReply& reply) const;
  /// "5", or the error.
  [[nodiscard]] std::string read(const std::string& name);
  [[nodiscard]] PacketSocket& socket() { return socket_; }

 private:
  const Sandbox& sandbox_;
  PacketSocket socket_;
  ValueReplyReader reader_;
  std::optional<SymbolTable> table_;
  std::uint64_t number_ = 0;
};

}  // namespace plchost::testing
