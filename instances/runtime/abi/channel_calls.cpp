// The calls by which applications send each other blocks: see plc_app.h.
#include <algorithm>
#include <cstring>
#include <utility>

#include "instances/runtime/application/application_host.hpp"
#include "shm/log/log.hpp"

using plchost::ApplicationHost;
using plchost::BlockChannel;
using plchost::BlockKind;
using plchost::BlockNode;
using plchost::BlockPriority;
using plchost::NodeAddress;
using plchost::Received;
using plchost::SendResult;
using plchost::TakeResult;

static_assert(PLC_MAX_BLOCK == plchost::kMaxBlockSize && PLC_MAX_CHANNEL_NAME == plchost::kMaxChannelName);
static_assert(PLC_BLOCK_EMERGENCY == std::to_underlying(BlockPriority::emergency) &&
              PLC_BLOCK_LOW == std::to_underlying(BlockPriority::low) &&
              PLC_BLOCK_REQUEST == std::to_underlying(BlockKind::request) &&
              PLC_BLOCK_REPLY == std::to_underlying(BlockKind::reply));
static_assert(PLC_ALL_NODES == NodeAddress{.host = 0, .node = NodeAddress::kAllNodes}.number());
static_assert(PLC_ALL_HOSTS ==
              NodeAddress{.host = NodeAddress::kAllHosts, .node = NodeAddress::kAllNodes}.number());

namespace {

RTS_RESULT result_of(SendResult result) noexcept {
  switch (result) {
    case SendResult::sent:
      return ERR_OK;
    case SendResult::congested:
      return ERR_NOBUFFER;
    case SendResult::connecting:
      return ERR_PENDING;
    case SendResult::unreachable:
      return ERR_NO_OBJECT;
    case SendResult::invalid:
      break;
  }
  return ERR_PARAMETER;
}

/// Checks what all ways to send have in common, and sends.
template <class Send>
RTS_RESULT send_by(RTS_HANDLE handle, int priority, const void* data, unsigned int bytes,
                   Send send) noexcept {
  ApplicationHost* const host = ApplicationHost::current();
  if (host == nullptr || host->blocks().node() == nullptr) return ERR_NOTINITIALIZED;
  BlockChannel* const channel = host->blocks().channel(handle);
  if (channel == nullptr || (data == nullptr && bytes != 0) || priority < PLC_BLOCK_EMERGENCY ||
      priority > PLC_BLOCK_LOW) {
    return ERR_PARAMETER;
  }
  const std::span contents(static_cast<const std::byte*>(data), bytes);
  return result_of(send(*channel, contents, static_cast<BlockPriority>(priority)));
}

}  // namespace

RTS_HANDLE plc_channel_open(const char* pszName, RTS_RESULT* pResult) {
  const auto finish = [&](RTS_RESULT result, RTS_HANDLE handle) {
    if (pResult != nullptr) *pResult = result;
    return handle;
  };
  ApplicationHost* const host = ApplicationHost::current_for_control();
  if (host == nullptr) return finish(ERR_NOTINITIALIZED, RTS_INVALID_HANDLE);
  if (pszName == nullptr) return finish(ERR_PARAMETER, RTS_INVALID_HANDLE);
  const auto handle = host->blocks().open_channel(pszName);
  if (handle) return finish(ERR_OK, *handle);
  spdlog::error("plc_channel_open: {}", handle.error().describe());
  const bool bad_name = handle.error().code == plchost::ErrorCode::invalid_argument;
  const bool no_room = handle.error().code == plchost::ErrorCode::full;
  return finish(bad_name ? ERR_PARAMETER : no_room ? ERR_NOMEMORY : ERR_FAILED, RTS_INVALID_HANDLE);
}

unsigned int plc_node_address(const char* pszInstance) {
  ApplicationHost* const host = ApplicationHost::current();
  BlockNode* const node = host == nullptr ? nullptr : host->blocks().node();
  if (node == nullptr) return PLC_NO_NODE;
  return (pszInstance == nullptr ? node->address() : node->find(pszInstance)).number();
}

RTS_RESULT plc_channel_send(RTS_HANDLE hChannel, unsigned int dwTo, int nPriority, const void* pData,
                            unsigned int dwBytes) {
  return send_by(hChannel, nPriority, pData, dwBytes,
                 [&](BlockChannel& channel, std::span<const std::byte> contents, BlockPriority priority) {
                   return channel.send(NodeAddress::from_number(dwTo), contents, priority);
                 });
}

RTS_RESULT plc_channel_request(RTS_HANDLE hChannel, unsigned int dwTo, int nPriority, const void* pData,
                               unsigned int dwBytes, unsigned int* pCorrelation) {
  if (pCorrelation == nullptr) return ERR_PARAMETER;
  return send_by(hChannel, nPriority, pData, dwBytes,
                 [&](BlockChannel& channel, std::span<const std::byte> contents, BlockPriority priority) {
                   return channel.request(NodeAddress::from_number(dwTo), contents, *pCorrelation, priority);
                 });
}

RTS_RESULT plc_channel_reply(RTS_HANDLE hChannel, const Block_Info* pRequest, const void* pData,
                             unsigned int dwBytes) {
  if (pRequest == nullptr || pRequest->dwSize < sizeof *pRequest) return ERR_PARAMETER;
  return send_by(hChannel, pRequest->bPriority, pData, dwBytes,
                 [&](BlockChannel& channel, std::span<const std::byte> contents, BlockPriority priority) {
                   const Received request{.size = pRequest->dwBytes,
                                          .from = NodeAddress::from_number(pRequest->dwFrom),
                                          .kind = BlockKind::request,
                                          .priority = priority,
                                          .correlation = pRequest->dwCorrelation};
                   return channel.reply(request, contents);
                 });
}

RTS_RESULT plc_channel_receive(RTS_HANDLE hChannel, void* pBuffer, unsigned int dwBufferSize,
                               Block_Info* pInfo) {
  ApplicationHost* const host = ApplicationHost::current();
  if (host == nullptr || host->blocks().node() == nullptr) return ERR_NOTINITIALIZED;
  BlockChannel* const channel = host->blocks().channel(hChannel);
  if (channel == nullptr || (pBuffer == nullptr && dwBufferSize != 0) || pInfo == nullptr ||
      pInfo->dwSize < sizeof *pInfo) {
    return ERR_PARAMETER;
  }
  Received received;
  const TakeResult result =
      channel->receive(std::span(static_cast<std::byte*>(pBuffer), dwBufferSize), received);
  if (result == TakeResult::none) return ERR_NO_OBJECT;
  pInfo->dwBytes = static_cast<unsigned int>(received.size);
  pInfo->dwFrom = received.from.number();
  pInfo->dwCorrelation = received.correlation;
  pInfo->bKind = static_cast<unsigned char>(received.kind);
  pInfo->bPriority = static_cast<unsigned char>(received.priority);
  return result == TakeResult::taken ? ERR_OK : ERR_BUFFERSIZE;
}
