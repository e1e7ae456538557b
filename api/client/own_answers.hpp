#pragma once

#include <cstdint>
#include <mutex>
#include <set>

#include <control.h>
#include <dds/dds.h>

#include "api/dds/error.hpp"
#include "api/dds/guid.hpp"
#include "shm/base/result.hpp"

namespace plchost {

/// The answers to one client. Each client of a participant gets what hosts answer to all of them. One that
/// takes nothing for a while would fill its readers, and Cyclone's receiving thread waits for a full reader.
/// An acknowledgement is kept for each source that posts, and new ones may post without an end. So answers to
/// others are not kept in the first place.
class OwnAnswers {
 public:
  OwnAnswers() = default;
  OwnAnswers(const OwnAnswers&) = delete;
  OwnAnswers& operator=(const OwnAnswers&) = delete;

  /// Answers to what `writer` asks are this client's, until remove(). Any thread.
  void add(const dds::Guid& writer) {
    const std::lock_guard lock(mutex_);
    writers_.insert(writer);
  }
  void remove(const dds::Guid& writer) {
    const std::lock_guard lock(mutex_);
    writers_.erase(writer);
  }
  [[nodiscard]] bool has(const dds::Guid& writer) const {
    const std::lock_guard lock(mutex_);
    return writers_.contains(writer);
  }

  /// Readers of `topic`, whose samples are `Answer`s, keep these only. Before it has a reader; this object
  /// outlives them.
  template <class Answer>
  [[nodiscard]] Result<void> filter(dds_entity_t topic) {
    return dds::check_code(dds_set_topic_filter_and_arg(topic, is_own<Answer>, this),
                           "cannot filter a topic");
  }

 private:
  static dds::Guid asker_of(const plc_Reply& reply) noexcept {
    return dds::Guid::from(reply.header.related_identity.writer_guid);
  }
  static dds::Guid asker_of(const plc_DownloadAck& ack) noexcept {
    return dds::Guid::from(ack.download.writer_guid);
  }
  static dds::Guid asker_of(const plc_EventRun& run) noexcept { return dds::Guid::from(run.source); }
  static dds::Guid asker_of(const plc_EventAck& ack) noexcept { return dds::Guid::from(ack.source); }
  /// A page.
  template <class Page>
  static dds::Guid asker_of(const Page& page) noexcept {
    return dds::Guid::from(page.related_identity.writer_guid);
  }
  // Called by the threads of Cyclone that receive.
  template <class Answer>
  static bool is_own(const void* sample, void* answers) noexcept {
    return static_cast<const OwnAnswers*>(answers)->has(asker_of(*static_cast<const Answer*>(sample)));
  }

  mutable std::mutex mutex_;
  std::set<dds::Guid> writers_;
};

}  // namespace plchost
