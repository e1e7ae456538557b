#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "instances/io/modbus/client/device_state.hpp"
#include "instances/io/modbus/client/link.hpp"
#include "instances/io/modbus/client/pdu.hpp"
#include "instances/io/modbus/client/unanswered.hpp"
#include "instances/io/modbus/config/map_values.hpp"
#include "instances/io/modbus/config/modbus_config.hpp"
#include "instances/io/modbus/images/image_table.hpp"
#include "instances/io/modbus/threads/log_pause.hpp"
#include "instances/io/modbus/threads/stop_event.hpp"
#include "shm/base/time.hpp"

namespace plchost::modbus {

/// One device: writes the outputs of a PLC to it, and its inputs into images. A poll puts all inputs into the
/// images, or none; those that are optional and refused are left out.
class Device {
 public:
  /// The images are those of the configuration.
  Device(const DeviceConfig& config, Link& link, const ImageTable& images, const StopEvent& stop);

  [[nodiscard]] const std::string& name() const noexcept { return config_.name; }
  /// Its thread: polls until the stop, then puts the outputs into their safe state.
  void run();
  /// One poll; run() does it. False: there was nothing to ask. The thread of run() only, or no thread runs.
  bool poll();
  /// run() is over.
  [[nodiscard]] bool has_ended() const noexcept { return has_ended_; }
  /// Of the last poll.
  [[nodiscard]] Quality quality() const noexcept { return quality_; }

  /// This process runs: another value of the counter in the status. Any thread.
  void count() { state_.count(); }
  /// Another process writes the outputs: nothing is asked, and the device is lost. Or it does no more. Any
  /// thread.
  void yield_outputs(bool yields) noexcept { yields_ = yields; }
  /// Puts the status into the bytes of an image, and zeros for inputs that are too old if so configured. Any
  /// thread, within the update of that image. `ended`: the device is polled no more.
  void show(const InputImage& image, std::span<std::byte> bytes, TimePoint now, bool ended = false) const;

 private:
  struct Input {
    const RegisterMap* map;
    InputImage* image;
    MapValues values;
    std::uint8_t refused = 0;  ///< of an optional map: the exception of its last request
    std::uint8_t told = 0;     ///< of them, in the log
  };
  struct Output {
    const RegisterMap* map;
    OutputImage* image;
    MapValues written;
    bool is_written = false;
    std::uint64_t connection = 0;  ///< on which it was written
    TimePoint written_at;
    bool is_silent = true;                 ///< its PLC; at first nothing was put out
    std::optional<bool> told_silent = {};  ///< in the log
  };

  [[nodiscard]] LinkResult write_outputs();
  [[nodiscard]] LinkResult write_output(Output& output);
  [[nodiscard]] bool is_due(Output& output, MapValues& values);
  [[nodiscard]] bool outputs_of(Output& output, MapValues& values);
  void tell_silence(Output& output, bool silent) const;
  [[nodiscard]] LinkResult read_inputs(TimePoint& asked_at);
  [[nodiscard]] LinkResult read_input(Input& input);
  [[nodiscard]] LinkResult read_map(Input& input);
  [[nodiscard]] bool is_noise(const LinkFailure& failure) const noexcept;
  [[nodiscard]] LinkResult tell_apart(const RegisterMap& map);
  void note(ResponseShape shape, const LinkResult& result);
  [[nodiscard]] bool is_gone(TimePoint now) const;
  [[nodiscard]] Duration good_for() const noexcept;
  void tell_old_inputs(TimePoint now);
  void publish_inputs(TimePoint now);
  void make_safe();
  void end_poll(const LinkResult& written, const LinkResult& read, TimePoint asked_at);
  void report(const LinkFailure* failure);
  void report_refused();

  const DeviceConfig& config_;
  Link& link_;
  const StopEvent& stop_;
  InputImage* status_image_;
  std::vector<Input> inputs_;
  std::vector<InputImage*> input_images_;  ///< of inputs_, each once
  std::vector<Output> outputs_;
  DeviceState state_;
  Unanswered unanswered_;  ///< at a serial line
  std::atomic<bool> has_ended_{false};
  std::atomic<bool> yields_{false};
  bool asked_ = false;               ///< the poll has something to ask
  bool told_old_ = false;            ///< that its inputs were too old, in the log
  bool touched_ = false;             ///< outputs were sent to it
  Quality quality_ = Quality::none;  ///< of the last poll
  Quality told_ = Quality::none;     ///< in the log
  LogPause log_pause_;
};

}  // namespace plchost::modbus
