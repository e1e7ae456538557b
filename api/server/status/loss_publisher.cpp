#include "api/server/status/loss_publisher.hpp"

#include <utility>

#include <fmt/format.h>

#include "api/dds/text.hpp"

namespace plchost {

namespace {

void put_loss(const LossRecord& loss, plc_LossStatus& sample) noexcept {
  sample.number = loss.number;
  dds::copy_text(sample.task, loss.task.view());
  sample.cause = std::to_underlying(loss.cause);
  dds::copy_text(sample.holder, loss.holder.view());
  sample.lost = loss.lost;
  sample.time_unix_ns = loss.unix_ns;
  sample.interval_ns = loss.interval_ns;
  sample.span_ns = loss.own_ns + loss.above_ns + loss.stall_ns + loss.other_ns;
  sample.own_ns = loss.own_ns;
  sample.above_ns = loss.above_ns;
  sample.stall_ns = loss.stall_ns;
  sample.other_ns = loss.other_ns;
}

}  // namespace

bool LossPublisher::follow(const InstanceStatus& instance, TimePoint now) {
  const std::string name(instance.name.view());
  Watched& watched = instances_[name];
  if (watched.pid != instance.pid) {
    watched = Watched{};
    watched.pid = instance.pid;
  }
  if (watched.pid == 0 || now < watched.next_look) return false;
  watched.next_look = now + kPeriod;
  bool changed = !watched.page && open_page(name, watched);
  if (watched.page) changed |= show(name, watched);
  return changed;
}

bool LossPublisher::open_page(const std::string& instance, Watched& watched) {
  auto page = FlightPageReader::open(pool_, instance);
  // The page of the process before is there until the next one has made its own.
  if (!page || page->pid() != watched.pid) return false;
  watched.page = std::move(*page);
  return table_->dispose_under(instance + "/");
}

bool LossPublisher::show(const std::string& instance, Watched& watched) {
  bool changed = false;
  for (std::size_t place = 0; place < kLossesKept; ++place) {
    const std::uint64_t sequence = watched.page->loss_sequence(place);
    if (sequence == watched.sequences[place]) continue;
    const auto loss = watched.page->loss(place);
    if (!loss) continue;
    watched.sequences[place] = sequence;
    plc_LossStatus sample = table_->blank();
    dds::copy_text(sample.instance, instance);
    sample.place = static_cast<std::uint32_t>(place);
    put_loss(*loss, sample);
    changed |= table_->update(fmt::format("{}/{}", instance, place), sample);
  }
  return changed;
}

bool LossPublisher::forget(const std::string& instance) {
  if (instances_.erase(instance) == 0) return false;
  return table_->dispose_under(instance + "/");
}

}  // namespace plchost
