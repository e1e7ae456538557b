#include "manager/control/command_server.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <sys/epoll.h>

#include "shm/files/memory_rights.hpp"
#include "shm/log/log.hpp"

namespace plchost {

namespace {

// So that one busy peer leaves room for the others in each round.
constexpr int kPacketsPerRound = 16;

// They have the group of the manager, as the API server has.
bool is_of_an_instance(uid_t user) {
  return !is_own_or_roots(user) && is_trusted_owner(user);
}

}  // namespace

CommandServer::CommandServer(Reactor& reactor, PacketListener listener, ControlHandler& handler)
    : reactor_(reactor),
      listener_(std::move(listener)),
      handler_(handler),
      accept_again_(reactor, [this] { (void)listen_watch_.change(EPOLLIN); }) {}

Result<std::unique_ptr<CommandServer>> CommandServer::open(Reactor& reactor, const std::string& path,
                                                           ControlHandler& handler) {
  PLCHOST_TRY_ASSIGN(auto listener, PacketListener::listen(path));
  std::unique_ptr<CommandServer> server(
      new CommandServer(reactor, std::move(listener), handler));  // NOLINT: the constructor is private
  PLCHOST_TRY_ASSIGN(
      server->listen_watch_,
      reactor.watch(server->listener_.fd(), EPOLLIN, [sut = server.get()](std::uint32_t) { sut->accept(); }));
  return server;
}

CommandServer::Connection* CommandServer::find(std::uint64_t id) {
  const auto found = connections_.find(id);
  return found == connections_.end() ? nullptr : &found->second;
}

void CommandServer::accept() {
  auto socket = listener_.accept();
  if (!socket) {
    // No descriptor left, most likely: asking again at once would only burn the core.
    spdlog::error("control socket: {}", socket.error().describe());
    (void)listen_watch_.change(0);
    accept_again_.set(MonotonicClock::now() + std::chrono::seconds(1));
    return;
  }
  if (!*socket) return;
  if (const auto user = (*socket)->peer_user(); !user || is_of_an_instance(*user))
    return spdlog::warn("control socket: an instance, or a program that it has started, is refused");
  if (connections_.size() >= kMaxConnections) {
    (void)(*socket)->send(encode(ControlReply{
        .number = 0,
        .code = ErrorCode::busy,
        .text = fmt::format("{} peers are connected already; more are not allowed", kMaxConnections)}));
    return;
  }
  const std::uint64_t id = next_id_++;
  auto watch = reactor_.watch((*socket)->fd(), EPOLLIN,
                              [this, id](std::uint32_t epoll_events) { on_ready(id, epoll_events); });
  if (!watch) return spdlog::error("control socket: {}", watch.error().describe());
  Connection& connection = connections_[id];
  connection.socket = std::move(**socket);
  connection.watch = std::move(*watch);
}

void CommandServer::on_ready(std::uint64_t id, std::uint32_t epoll_events) {
  if ((epoll_events & EPOLLOUT) != 0) {
    Connection* connection = find(id);
    if (connection != nullptr && !flush(*connection)) return close(id, "cannot be sent to");
  }
  for (int i = 0; i < kPacketsPerRound; ++i) {
    Connection* connection = find(id);
    if (connection == nullptr) return;
    auto packet = connection->socket.receive();
    if (!packet && packet.error().code == ErrorCode::corrupt) {
      if (++connection->bad_packets > kMaxBadPackets) return close(id, "sends no requests");
      answer(id, ControlReply{.number = 0, .code = ErrorCode::corrupt, .text = packet.error().describe()});
      continue;
    }
    if (!packet) return close(id, "");
    if (!*packet) return;
    take_packet(id, **packet);
  }
}

void CommandServer::take_packet(std::uint64_t id, std::string_view packet) {
  Connection& connection = *find(id);
  const auto request = decode_request(packet);
  if (!request) {
    if (++connection.bad_packets > kMaxBadPackets) return close(id, "sends no requests");
    return answer(id,
                  ControlReply{.number = 0, .code = ErrorCode::corrupt, .text = request.error().describe()});
  }
  if (connection.pending >= kMaxPendingRequests) {
    return answer(id, ControlReply{.number = request->number,
                                   .code = ErrorCode::busy,
                                   .text = fmt::format("{} requests of this peer are not answered yet",
                                                       kMaxPendingRequests)});
  }
  const KnownRequests::Asker asker{.connection = id, .number = request->number};
  if (const auto earlier = known_.find(*request, asker)) {
    ++connection.pending;
    if (earlier->answer) answer({asker}, *earlier->answer);
    return;
  }
  if (const auto in_time = check_in_time(request->limit_ns); !in_time) {
    return answer(
        id, ControlReply{
                .number = request->number, .code = in_time.error().code, .text = in_time.error().message});
  }
  begin(connection, *request, asker);
}

void CommandServer::begin(Connection& connection, const ControlRequest& request, KnownRequests::Asker asker) {
  ++connection.pending;
  known_.begin(request, asker, MonotonicClock::now());
  handler_.handle(request, [this, asker, key = request.id](const ControlReply& reply) {
    answer(known_.end(key, asker, reply, MonotonicClock::now()), reply);
  });
}

// Each by its own number.
void CommandServer::answer(const std::vector<KnownRequests::Asker>& askers, ControlReply reply) {
  for (const auto& [id, number] : askers) {
    if (Connection* connection = find(id)) --connection->pending;
    reply.number = number;
    answer(id, reply);
  }
}

void CommandServer::answer(std::uint64_t id, const ControlReply& reply) {
  Connection* connection = find(id);
  if (connection == nullptr) return;  // it has gone without waiting for the answer
  connection->unsent.push_back(encode(reply));
  if (connection->unsent.size() > kMaxUnreadReplies) return close(id, "does not read its replies");
  if (!flush(*connection)) close(id, "cannot be sent to");
}

bool CommandServer::flush(Connection& connection) {
  while (!connection.unsent.empty()) {
    const auto sent = connection.socket.send(connection.unsent.front());
    if (!sent && sent.error().code == ErrorCode::busy) {
      return connection.watch.change(EPOLLIN | EPOLLOUT).has_value();
    }
    if (!sent) return false;
    connection.unsent.pop_front();
  }
  return connection.watch.change(EPOLLIN).has_value();
}

void CommandServer::close(std::uint64_t id, std::string_view why) {
  if (!why.empty()) spdlog::warn("control socket: a peer {}; it is disconnected", why);
  connections_.erase(id);
}

bool CommandServer::waits_for_answers() const noexcept {
  return std::ranges::any_of(connections_, [](const auto& entry) {
    return entry.second.pending != 0 || !entry.second.unsent.empty();
  });
}

}  // namespace plchost
