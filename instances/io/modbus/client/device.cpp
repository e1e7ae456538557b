#include "instances/io/modbus/client/device.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>

#include <fmt/format.h>

#include "instances/io/modbus/threads/poll_schedule.hpp"
#include "shm/base/names.hpp"
#include "shm/log/log.hpp"

namespace plchost::modbus {

namespace {

// So that the outputs of several maps get their safe state in the time that the end of the process has.
constexpr std::chrono::milliseconds kSafeStateTimeout{300};
// For the connection, and again for the response, of one that did not answer last.
constexpr std::chrono::milliseconds kLastAttempt{100};

}  // namespace

Device::Device(const DeviceConfig& config, Link& link, const ImageTable& images, const StopEvent& stop)
    : config_(config), link_(link), stop_(stop), status_image_(images.input(config.status_image)) {
  for (const RegisterMap& map : config.reads) {
    InputImage* const image = images.input(map.image);
    inputs_.push_back({.map = &map, .image = image, .values = {}});
    if (std::ranges::find(input_images_, image) == input_images_.end()) input_images_.push_back(image);
  }
  for (const RegisterMap& map : config.writes) {
    outputs_.push_back({.map = &map, .image = images.output(map.image), .written = {}, .written_at = {}});
  }
  if (!config.serial.empty() && config.probe) unanswered_ = Unanswered::of_process_before();
}

void Device::run() {
  PollSchedule schedule(config_.poll, config_.reconnect, config_.reconnect_max, MonotonicClock::now());
  while (!stop_.wait_until(schedule.next())) {
    const bool asked = poll();
    if (asked && quality_ == Quality::lost) {
      schedule.failed(MonotonicClock::now());
    } else {
      schedule.answered(MonotonicClock::now());
    }
  }
  make_safe();
  if (schedule.skipped() != 0) {
    spdlog::info("device '{}': {} skipped because the one before took too long", config_.name,
                 count_text(schedule.skipped(), "poll was", "polls were"));
  }
  has_ended_ = true;
}

bool Device::poll() {
  if (yields_) {
    const LinkResult yielded = std::unexpected(LinkFailure{.text = "another process writes its outputs"});
    end_poll(yielded, yielded, {});
    return true;
  }
  asked_ = !inputs_.empty();
  const LinkResult written = write_outputs();
  if (!asked_) return false;  // nothing was due, so nothing is known
  const bool is_there = written || written.error().is_refusal();
  TimePoint asked_at = MonotonicClock::now();
  const LinkResult read = is_there ? read_inputs(asked_at) : written;
  end_poll(written, read, asked_at);
  return true;
}

// A refused map does not keep the others from being written.
LinkResult Device::write_outputs() {
  LinkResult result;
  for (Output& output : outputs_) {
    const LinkResult written = write_output(output);
    if (written) continue;
    result = written;
    if (!written.error().is_refusal()) break;
  }
  return result;
}

bool Device::is_due(Output& output, MapValues& values) {
  if (!outputs_of(output, values)) return false;
  const Duration age = MonotonicClock::now() - output.written_at;
  return !output.is_written || output.connection != link_.connection() || values != output.written ||
         (output.map->rewrite > Duration::zero() && age >= output.map->rewrite);
}

LinkResult Device::write_output(Output& output) {
  MapValues values;
  if (!is_due(output, values)) return {};
  // While the others of a serial line have their turns, or a connection is made, the PLC may have stopped.
  const Link::Turn turn = link_.take_turn();
  LinkResult result;
  bool goes_on = true;
  const auto look = [&](MapValues& now) {
    now = MapValues();
    goes_on = outputs_of(output, now);
    return goes_on;
  };
  // A connection at rest may end while it is written to, and a response be garbled. The values are then those
  // of the second attempt.
  for (bool again = true;; again = false) {
    result = link_.open(config_);
    values = MapValues();
    if (result && !is_due(output, values)) return {};
    if (result) {
      // A request without a whole response may be carried out.
      touched_ = true;
      output.is_written = false;
      result = link_.write(config_, *output.map, values, look);
    }
    note(write_shape(*output.map), result);
    if (result || !again || !(result.error().at_rest || is_noise(result.error()))) break;
  }
  asked_ = true;
  output.is_written = result.has_value() && goes_on;
  output.connection = link_.connection();
  output.written = values;
  output.written_at = MonotonicClock::now();
  return result;
}

// False: nothing is to be written.
bool Device::outputs_of(Output& output, MapValues& values) {
  bool silent = false;
  output.image->look([&](std::span<const std::byte> bytes, const OutputImage::Shown& shown) {
    // Outputs that are only kept are not switched on again: a fault, a new process or the end says no values.
    // Nor are they by a start of this process, which does not know what silence was before.
    silent = shown.silence >= config_.silent_after || (output.is_silent && shown.kept);
    if (!silent) values.read_from(*output.map, bytes);
  });
  tell_silence(output, silent);
  return !silent || config_.when_silent == LossPolicy::zero;
}

void Device::tell_silence(Output& output, bool silent) const {
  output.is_silent = silent;
  if (std::exchange(output.told_silent, silent) == silent) return;
  if (silent) {
    spdlog::warn("device '{}': the PLC of image '{}' is silent: outputs from address {} {}", config_.name,
                 output.image->name(), output.map->address,
                 config_.when_silent == LossPolicy::zero ? "become zero" : "stay as they are");
  } else {
    spdlog::info("device '{}': the PLC of image '{}' says the outputs from address {}", config_.name,
                 output.image->name(), output.map->address);
  }
}

// A device may answer with values that it had when it was asked, not before.
LinkResult Device::read_inputs(TimePoint& asked_at) {
  for (Input& input : inputs_) {
    const Link::Turn turn = link_.take_turn();
    if (&input == &inputs_.front()) asked_at = MonotonicClock::now();
    if (auto read = read_input(input); !read) return read;
  }
  return {};
}

LinkResult Device::read_input(Input& input) {
  for (bool again = true;; again = false) {
    LinkResult read = tell_apart(*input.map);
    if (read) read = read_map(input);
    if (read || !again || !is_noise(read.error())) return read;
  }
}

LinkResult Device::read_map(Input& input) {
  auto read = link_.read(config_, *input.map, input.values);
  note(read_shape(*input.map), read);
  input.refused = 0;
  if (read || !input.map->optional || !read.error().is_refusal()) return read;
  input.refused = read.error().exception;
  return {};
}

// It is no reason to give a device up. One that sends nothing else would cost the others twice the time.
bool Device::is_noise(const LinkFailure& failure) const noexcept {
  return failure.is_garbled && quality_ != Quality::lost;
}

// A device that answers one request too late would do so forever, with the values of other registers. So
// after a failure it is asked for something that cannot be mistaken for a response that may still come.
LinkResult Device::tell_apart(const RegisterMap& map) {
  while (unanswered_.may_come(read_shape(map))) {
    const auto other = unanswered_.probe(config_.reads);
    if (!other) break;
    MapValues ignored;
    auto read = link_.read(config_, *other, ignored);
    note(read_shape(*other), read);
    if (read) continue;
    // Also if it was refused: a device that refuses all would be asked again and again, and others wait.
    if (!read.error().not_sent && !read.error().not_asked) {
      read.error().text += fmt::format(
          ", when it was asked for {} from address {} to tell late responses apart{}", other->count,
          other->address, read.error().timed_out ? "; if it never answers that, set probe = false" : "");
    }
    return read;
  }
  return {};
}

void Device::note(ResponseShape shape, const LinkResult& result) {
  if (config_.serial.empty() || !config_.probe) return;
  if (result) {
    unanswered_.answered(shape);
  } else if (result.error().exception != 0) {
    unanswered_.refused(shape);
  } else if (!result.error().not_asked && !result.error().not_sent) {
    unanswered_.given_up(shape);
  }
}

// Zeros in place of inputs are not good.
Duration Device::good_for() const noexcept {
  return config_.when_gone == LossPolicy::zero && !inputs_.empty() ? config_.gone_after : Duration::max();
}

bool Device::is_gone(TimePoint now) const {
  return config_.when_gone == LossPolicy::zero && state_.is_older(now, config_.gone_after);
}

// Once, until the device is lost and answers again.
void Device::tell_old_inputs(TimePoint now) {
  if (told_old_ || good_for() == Duration::max() || !is_gone(now)) return;
  told_old_ = true;
  spdlog::warn(
      "device '{}' answers, but its inputs became {} ms old, and zero at gone_after_ms = {}; give "
      "gone_after_ms more than the time of two polls",
      config_.name, state_.status(now, good_for()).age_ms,
      std::chrono::duration_cast<std::chrono::milliseconds>(config_.gone_after).count());
}

// A reading may take so long that its inputs are too old from the beginning: then they are never shown.
void Device::publish_inputs(TimePoint now) {
  const bool gone = is_gone(now);
  for (InputImage* const image : input_images_) {
    image->update([&](std::span<std::byte> bytes) {
      for (Input& input : inputs_) {
        if (input.image != image) continue;
        if (gone || (input.refused != 0 && config_.when_gone == LossPolicy::zero)) {
          put_zeros(*input.map, bytes);
        } else if (input.refused == 0) {
          input.values.write_to(*input.map, bytes);
        }
      }
    });
  }
}

void Device::end_poll(const LinkResult& written, const LinkResult& read, TimePoint asked_at) {
  const LinkFailure* const failure = !read ? &read.error() : !written ? &written.error() : nullptr;
  if (failure != nullptr && failure->not_asked) return;
  const auto refused = std::ranges::find_if(inputs_, [](const Input& input) { return input.refused != 0; });
  const std::uint8_t exception = failure != nullptr         ? failure->exception
                                 : refused != inputs_.end() ? refused->refused
                                                            : std::uint8_t{0};
  const bool was_good = quality_ == Quality::good;
  quality_ = failure == nullptr ? Quality::good : failure->is_refusal() ? Quality::exception : Quality::lost;
  if (quality_ == Quality::lost) {
    told_old_ = false;
    for (Output& output : outputs_) output.is_written = false;
  }
  const TimePoint now = MonotonicClock::now();
  if (was_good && read) tell_old_inputs(now);
  if (read) {
    state_.read(asked_at);  // first: inputs that are too old become zero
    publish_inputs(now);
  }
  state_.polled(quality_, exception);  // behind the inputs: none is shown as good that has not come
  if (status_image_ != nullptr)
    status_image_->update([&](std::span<std::byte> bytes) { show(*status_image_, bytes, now); });
  report(failure);
}

// Once for each change, and at most once a second.
void Device::report(const LinkFailure* failure) {
  if (quality_ == told_) return report_refused();
  if (!log_pause_.is_over(MonotonicClock::now())) return;
  told_ = quality_;
  if (failure == nullptr) {
    spdlog::info("device '{}' answers", config_.name);
  } else if (failure->is_refusal()) {
    spdlog::warn("device '{}' refuses a request with exception {}: {}", config_.name, failure->exception,
                 failure->text);
  } else if (failure->exception != 0) {
    spdlog::warn("device '{}' is lost: its gateway answers with exception {}: {}", config_.name,
                 failure->exception, failure->text);
  } else {
    spdlog::warn("device '{}' is lost: {}", config_.name, failure->text);
  }
}

void Device::report_refused() {
  for (Input& input : inputs_) {
    if (input.refused == input.told || !log_pause_.is_over(MonotonicClock::now())) continue;
    input.told = input.refused;
    if (input.refused == 0) {
      spdlog::info("device '{}' answers from address {}", config_.name, input.map->address);
    } else {
      spdlog::warn("device '{}' refuses the optional map from address {} with exception {}", config_.name,
                   input.map->address, input.refused);
    }
  }
}

// A device that refuses one map, or that did not answer last, may take the others.
void Device::make_safe() {
  if (yields_) {
    spdlog::warn("device '{}': its outputs stay as they are: another process writes them", config_.name);
    return;
  }
  const bool untouched = quality_ == Quality::none && !touched_;
  if (config_.when_silent != LossPolicy::zero || untouched) return;
  const Duration limit = quality_ == Quality::lost ? kLastAttempt : kSafeStateTimeout;
  bool is_there = true;
  for (const Output& output : outputs_) {
    MapValues zeros;
    const Duration timeout = std::min(config_.timeout, limit);
    LinkResult written = std::unexpected(LinkFailure{.text = "it does not answer"});
    if (is_there) written = link_.write_at_end(config_, *output.map, zeros, timeout);
    if (!written && is_noise(written.error()))
      written = link_.write_at_end(config_, *output.map, zeros, timeout);
    if (written) continue;
    spdlog::warn("device '{}': its outputs from address {} were not set to zero: {}", config_.name,
                 output.map->address, written.error().text);
    is_there = written.error().is_refusal();
  }
}

void Device::show(const InputImage& image, std::span<std::byte> bytes, TimePoint now, bool ended) const {
  if (ended ? config_.when_gone == LossPolicy::zero : is_gone(now)) {
    for (const Input& input : inputs_) {
      if (input.image == &image) put_zeros(*input.map, bytes);
    }
  }
  if (status_image_ != &image) return;
  const DeviceStatus status = ended ? DeviceStatus{.age_ms = kNeverRead} : state_.status(now, good_for());
  std::memcpy(bytes.data() + config_.status_offset, &status, sizeof status);
}

}  // namespace plchost::modbus
