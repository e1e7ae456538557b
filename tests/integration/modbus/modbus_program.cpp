#include "tests/integration/modbus/modbus_program.hpp"

#include <array>
#include <csignal>
#include <cstring>
#include <fstream>
#include <sstream>

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/files/pool_files.hpp"
#include "tests/support/own_name.hpp"

namespace plchost::testing {

Plant::Plant() : pool_(own_name("modbus")), folder_(std::filesystem::temp_directory_path() / pool_) {
  std::filesystem::create_directories(folder_);
  EXPECT_EQ(plc_image_open(pool_.c_str(), "t.in", kSize, PLC_IMAGE_READ, &inputs_), 0);
  EXPECT_EQ(plc_image_open(pool_.c_str(), "t.out", kSize, PLC_IMAGE_WRITE, &outputs_), 0);
}

Plant::~Plant() {
  plc_image_close(&inputs_);
  plc_image_close(&outputs_);
  remove_pool_memories(pool_);
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

std::string Plant::write(std::string_view text) const {
  static int count = 0;
  std::string path = file(fmt::format("{}.toml", ++count));
  std::ofstream(path) << fmt::format(
      "[modbus]\npool = \"{}\"\n"
      "[[image]]\nname = \"t.in\"\ndirection = \"input\"\nsize = {}\n"
      "[[image]]\nname = \"t.out\"\ndirection = \"output\"\nsize = {}\n{}",
      pool_, kSize, kSize, text);
  return path;
}

std::vector<std::uint8_t> Plant::inputs() const {
  std::vector<std::uint8_t> bytes(kSize);
  (void)plc_image_read(&inputs_, bytes.data(), nullptr);
  return bytes;
}

std::uint16_t Plant::input_word(unsigned offset) const {
  std::uint16_t word = 0;
  std::memcpy(&word, inputs().data() + offset, sizeof word);
  return word;
}

modbus::DeviceStatus Plant::status(unsigned offset) const {
  modbus::DeviceStatus status;
  std::memcpy(&status, inputs().data() + offset, sizeof status);
  return status;
}

void Plant::put_out(unsigned offset, std::uint16_t word) {
  std::array<std::uint8_t, kSize> bytes{};
  std::memcpy(bytes.data() + offset, &word, sizeof word);
  plc_image_write(&outputs_, bytes.data());
}

void Plant::die_and_keep() {
  plc_image_hold(&outputs_, 1);
  outputs_.header->on_end = 0;
  plc_image_tell(&outputs_, PLC_IMAGE_STATE_ENDED, 0);
}

void Plant::keep(unsigned state) {
  std::array<std::uint8_t, kSize> bytes{};
  (void)plc_image_read_latest(&outputs_, bytes.data(), nullptr);
  plc_image_hold(&outputs_, 1);
  outputs_.header->on_end = 0;
  plc_image_set_safe(&outputs_, bytes.data());
  plc_image_tell(&outputs_, state, 1);
}

void Plant::show_safe(unsigned state, std::uint16_t word, bool holds) {
  std::array<std::uint8_t, kSize> bytes{};
  std::memcpy(bytes.data(), &word, sizeof word);
  plc_image_hold(&outputs_, holds ? 1 : 0);
  outputs_.header->on_end = holds ? 1 : 0;
  plc_image_set_safe(&outputs_, bytes.data());
  plc_image_tell(&outputs_, state, 1);
}

ModbusProgram::ModbusProgram(const Plant& plant, const std::string& config, std::string_view log)
    : ModbusProgram(plant.file(std::string(log)), config) {}

ModbusProgram::ModbusProgram(std::string log_file, const std::string& config)
    : log_file_(std::move(log_file)) {
  posix_spawn_file_actions_t actions{};
  posix_spawn_file_actions_init(&actions);
  for (const int fd : {STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&actions, fd, log_file_.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  }
  std::string program = PLCHOST_MODBUS_PROGRAM;
  std::string option = "--config";
  std::string file = config;
  std::array<char*, 4> arguments{program.data(), option.data(), file.data(), nullptr};
  const int error = ::posix_spawn(&pid_, program.c_str(), &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  EXPECT_EQ(error, 0);
}

ModbusProgram::~ModbusProgram() {
  if (pid_ > 0) (void)end(SIGKILL);
}

int ModbusProgram::end(int signal) {
  if (pid_ <= 0) return -1;
  if (signal != 0) ::kill(pid_, signal);
  // One that was to end by itself, and does not.
  siginfo_t ended{};
  const auto has_ended = [&] {
    return ::waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT) == 0 &&
           ended.si_pid == pid_;
  };
  if (signal == 0 && !eventually(has_ended)) ::kill(pid_, SIGKILL);
  int status = 0;
  ::waitpid(std::exchange(pid_, -1), &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

std::string ModbusProgram::log() const {
  std::stringstream text;
  text << std::ifstream(log_file_).rdbuf();
  return text.str();
}

int ModbusProgram::told(std::string_view text) const {
  const std::string lines = log();
  int times = 0;
  for (std::size_t at = 0; (at = lines.find(text, at)) != std::string::npos; at += text.size()) ++times;
  return times;
}

}  // namespace plchost::testing
