#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "instances/io/modbus/config/modbus_config.hpp"
#include "shm/plc_process_image.h"

namespace plchost::testing {

/// Looks again and again until it holds, or gives up after a time that only a fault takes.
[[nodiscard]] bool eventually(const std::function<bool()>& condition);

/// A pool name and a folder of one test, with an input image "t.in" and an output image "t.out", 64 bytes
/// each, as an instance has them. All is gone when it ends.
class Plant {
 public:
  static constexpr unsigned kSize = 64;
  Plant();
  ~Plant();
  Plant(const Plant&) = delete;
  Plant& operator=(const Plant&) = delete;

  /// A file with [modbus], both images and this text.
  [[nodiscard]] std::string write(std::string_view text) const;
  [[nodiscard]] std::string file(const std::string& name) const { return (folder_ / name).string(); }
  [[nodiscard]] const std::string& pool() const { return pool_; }

  /// The inputs, as a PLC has them in a cycle.
  [[nodiscard]] std::vector<std::uint8_t> inputs() const;
  [[nodiscard]] std::uint16_t input_word(unsigned offset) const;
  [[nodiscard]] modbus::DeviceStatus status(unsigned offset) const;
  /// Puts out an image with this word, and zeros.
  void put_out(unsigned offset, std::uint16_t word);
  /// Tells this state of the PLC (PLC_IMAGE_STATE_...), and shows a safe image with this word at byte 0.
  /// `holds`: its settings name a safe state.
  void show_safe(unsigned state, std::uint16_t word, bool holds = true);
  /// Tells this state of a PLC whose settings keep its outputs.
  void keep(unsigned state);
  /// The death of a PLC whose settings keep its outputs, as the manager tells it.
  void die_and_keep();
  /// A task of the next process has put outputs out.
  void run() { plc_image_resume(&outputs_, plc_image_control(&outputs_)); }
  /// A sign of the PLC.
  void beat() { plc_image_beat(&outputs_); }

 private:
  std::string pool_;
  std::filesystem::path folder_;
  plc_image inputs_{};
  plc_image outputs_{};
};

/// A real plchost-modbus, which is killed if it is still there at the end.
class ModbusProgram {
 public:
  ModbusProgram(const Plant& plant, const std::string& config, std::string_view log = "modbus.log");
  ModbusProgram(std::string log_file, const std::string& config);
  ~ModbusProgram();
  ModbusProgram(const ModbusProgram&) = delete;
  ModbusProgram& operator=(const ModbusProgram&) = delete;

  /// Sends the signal; 0: none, and it is killed if it goes on for long. Then waits for the end: the exit
  /// code, or minus the signal that ended it.
  int end(int signal = 0);
  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] std::string log() const;
  [[nodiscard]] bool logged(std::string_view text) const { return told(text) > 0; }
  /// How often the log has it.
  [[nodiscard]] int told(std::string_view text) const;

 private:
  std::string log_file_;
  pid_t pid_ = -1;
};

}  // namespace plchost::testing
