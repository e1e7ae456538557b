#pragma once

#include <cstdint>

#include "api/dds/gate/host_mark.hpp"

namespace plchost {

/// Puts dds::admit() in front of DDS, of a secured host also dds::HandshakeAssembly and
/// dds::take_out_doubted(), of an unsecured one dds::SourceTable. All datagrams that this process receives
/// over IP with recvmsg() go through them. Those that are refused, or have no contents any more, are made so
/// short that DDS drops them without a look. So are announcements of hosts that do not concern `own`, which
/// has to announce that itself (ServerOptions::announced). Only the program plchost-dds has it. Before the
/// domain is made.
void close_receive_gate(bool secured, const dds::HostMark& own);

/// How many datagrams it has refused, whole or in part.
[[nodiscard]] std::uint64_t datagrams_refused() noexcept;

}  // namespace plchost
