#pragma once

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <fmt/format.h>

#include "tests/support/own_name.hpp"

namespace plchost {

/// A folder with the files of the kernel that say how fast cores must wake up, and with a run directory.
class FakeSysfs {
 public:
  FakeSysfs() {
    folder_ = own_path("sysfs");
    std::filesystem::create_directories(run_directory());
    write(device(), "");
  }
  ~FakeSysfs() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  FakeSysfs(const FakeSysfs&) = delete;
  FakeSysfs& operator=(const FakeSysfs&) = delete;

  void add_core(int core, const std::string& latency) const {
    std::filesystem::create_directories(std::filesystem::path(latency_file(core)).parent_path());
    write(latency_file(core), latency);
  }
  [[nodiscard]] std::string latency(int core) const {
    std::string text = read(latency_file(core));
    while (text.ends_with('\n')) text.pop_back();
    return text;
  }
  [[nodiscard]] std::string sysfs() const { return folder_ / "sys"; }
  [[nodiscard]] std::string device() const { return folder_ / "cpu_dma_latency"; }
  [[nodiscard]] std::string run_directory() const { return folder_ / "run"; }
  [[nodiscard]] std::string latency_file(int core) const {
    return fmt::format("{}/devices/system/cpu/cpu{}/power/pm_qos_resume_latency_us", sysfs(), core);
  }
  [[nodiscard]] std::string record(int core) const {
    return fmt::format("{}/core{}.latency", run_directory(), core);
  }
  [[nodiscard]] bool records_are_gone() const { return std::filesystem::is_empty(run_directory()); }

  static void write(const std::string& file, const std::string& text) { std::ofstream(file) << text; }
  [[nodiscard]] static std::string read(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace plchost
