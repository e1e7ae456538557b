#include "api/dds/client_gate.hpp"

#include <mutex>
#include <span>

#include "api/dds/gate/handshake_assembly.hpp"
#include "api/dds/gate/packet_gate.hpp"
#include "api/dds/gate/renewal_gate.hpp"
#include "api/dds/handshake_record.hpp"

namespace plchost::dds {

extern "C" std::size_t pass_to_client(unsigned char* buffer, std::size_t size, std::size_t capacity) {
  // Each domain receives with a thread of its own.
  static std::mutex mutex;
  static HandshakeAssembly assembly;
  const std::span whole(reinterpret_cast<std::byte*>(buffer), capacity);
  const std::lock_guard lock(mutex);
  if (admit(whole.first(size), true) == Admission::refused) return 0;
  return take_out_doubted(whole.first(assembly.rewrite(whole, size)), own_record());
}

}  // namespace plchost::dds
