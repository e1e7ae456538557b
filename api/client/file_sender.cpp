#include "api/client/file_sender.hpp"

#include <algorithm>
#include <utility>

#include "api/client/met_readers.hpp"
#include "api/dds/sample_identity.hpp"
#include "api/dds/sequence.hpp"
#include "api/dds/text.hpp"
#include "api/dds/topics.hpp"

namespace plchost {

Result<FileSender> FileSender::create(dds_entity_t participant, dds_entity_t topic, const std::string& host,
                                      std::span<const std::byte> contents) {
  FileSender sender;
  PLCHOST_TRY_ASSIGN(sender.way_, dds::open_writer(participant, dds::host_partition(host), topic,
                                                   dds::qos_of(dds::kDownloadChunk)));
  sender.host_ = host;
  sender.contents_ = contents;
  return sender;
}

void FileSender::on_ack(const plc_DownloadAck& ack, const plc_SampleIdentity& download, TimePoint now) {
  const bool ours = same_identity(ack.download, download) && dds::text_of(ack.host) == host_;
  if (!ours || ack.received > contents_.size()) return;
  const std::uint64_t before = epoch_.value();
  if (!epoch_.accept(ack.epoch, now)) return;
  const bool anew = ack.epoch != before;
  if (!anew && ack.received <= received_) return;
  received_ = ack.received;
  window_ = ack.window;
  next_ = anew ? received_ : std::max(next_, received_);
  last_news_ = last_try_ = now;
}

TimePoint FileSender::send(const plc_SampleIdentity& download, const plc_TimeLimit& limit, TimePoint now) {
  if (epoch_.value() == 0 || !has_reader(way_.writer.get())) return now + kLook;
  if (next_ > received_ && now - last_try_ >= kRepeat) {
    next_ = received_;
    last_try_ = now;
  }
  plc_DownloadChunk chunk{};
  chunk.download = download;
  chunk.limit = limit;
  dds::copy_text(chunk.host, host_);
  const std::uint64_t end = std::min<std::uint64_t>(contents_.size(), received_ + window_);
  while (next_ < end) {
    const auto size = std::min<std::uint64_t>(dds::kMaxChunk, end - next_);
    const auto piece = contents_.subspan(next_, size);
    chunk.offset = next_;
    dds::lend_bytes(chunk.contents, piece);
    if (dds_write(way_.writer.get(), &chunk) != DDS_RETCODE_OK) break;  // goes again as one that was lost
    next_ += size;
  }
  return std::min(last_try_ + kRepeat, now + kRepeat);
}

}  // namespace plchost
