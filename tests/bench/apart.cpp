#include "tests/bench/apart.hpp"

#include <bit>
#include <cstdint>
#include <iomanip>
#include <sstream>

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "shm/base/unique_fd.hpp"
#include "tests/bench/child.hpp"

namespace plchost::bench {

namespace {

// As their bits: a stream cannot read what is not a number.
void write_double(std::ostream& to, double value) {
  to << std::bit_cast<std::uint64_t>(value) << ' ';
}

double read_double(std::istream& from) {
  std::uint64_t bits = 0;
  from >> bits;
  return std::bit_cast<double>(bits);
}

void write_text(std::ostream& to, const std::string& text) {
  to << std::quoted(text) << ' ';
}

std::string read_text(std::istream& from) {
  std::string text;
  from >> std::quoted(text);
  return text;
}

void write_samples(std::ostream& to, const Samples& samples) {
  to << samples.size() << ' ';
  for (const Duration value : samples.values()) to << value.count() << ' ';
}

Samples read_samples(std::istream& from) {
  std::size_t count = 0;
  from >> count;
  Samples samples;
  for (std::size_t i = 0; i < count && from; ++i) {
    Duration::rep value = 0;
    from >> value;
    samples.push(Duration(value));
  }
  return samples;
}

std::size_t read_count(std::istream& from) {
  std::size_t count = 0;
  from >> count;
  return from ? count : 0;
}

/// The measurements of the process, or why it has none: the first word tells which.
std::string text_of(const Result<std::vector<Row>>& rows) {
  std::ostringstream text;
  if (!rows) {
    text << "failed " << rows.error().describe();
    return text.str();
  }
  text << "rows " << rows->size() << ' ';
  for (const Row& row : *rows) write_row(text, row);
  return text.str();
}

Result<std::vector<Row>> rows_of(const std::string& said) {
  std::istringstream text(said);
  std::string word;
  text >> word;
  if (word != "rows")
    return failure(ErrorCode::system, word == "failed" ? said.substr(7) : "it said nothing");
  std::vector<Row> rows(read_count(text));
  for (Row& row : rows) row = read_row(text);
  return rows;
}

bool write_all(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

void write_row(std::ostream& to, const Row& row) {
  for (const std::string* const text : {&row.name, &row.sample, &row.note}) write_text(to, *text);
  write_samples(to, row.ours);
  write_samples(to, row.floor);
  to << row.extra.size() << ' ';
  for (const auto& [key, value] : row.extra) {
    write_text(to, key);
    write_double(to, value);
  }
  to << row.targets.size() << ' ';
  for (const Target& target : row.targets) {
    write_text(to, target.text);
    write_text(to, target.unit);
    write_double(to, target.measured);
    write_double(to, target.bound);
    to << target.or_equal << ' ' << target.only_steady << ' ';
  }
}

Row read_row(std::istream& from) {
  Row row;
  for (std::string* const text : {&row.name, &row.sample, &row.note}) *text = read_text(from);
  row.ours = read_samples(from);
  row.floor = read_samples(from);
  row.extra.resize(read_count(from));
  for (auto& [key, value] : row.extra) {
    key = read_text(from);
    value = read_double(from);
  }
  row.targets.resize(read_count(from));
  for (Target& target : row.targets) {
    target.text = read_text(from);
    target.unit = read_text(from);
    target.measured = read_double(from);
    target.bound = read_double(from);
    from >> target.or_equal >> target.only_steady;
  }
  return row;
}

Result<std::vector<Row>> measure_apart(const std::function<Result<std::vector<Row>>()>& measure) {
  const UniqueFd said(::memfd_create("rows", MFD_CLOEXEC));
  if (!said) return failure(ErrorCode::system, "memfd_create", errno);
  const pid_t parent = ::getpid();
  const pid_t process = ::fork();
  if (process < 0) return failure(ErrorCode::system, "fork", errno);
  if (process == 0) {
    end_with(parent, SIGTERM);
    ::_exit(write_all(said.get(), text_of(measure())) ? 0 : 1);
  }
  int status = 0;
  if (::waitpid(process, &status, 0) != process) return failure(ErrorCode::system, "waitpid", errno);
  if (status != 0)
    return failure(ErrorCode::system, fmt::format("its process ended with status {:#x}", status));
  std::string text;
  struct stat file{};
  ::fstat(said.get(), &file);
  text.resize(static_cast<std::size_t>(file.st_size));
  if (::pread(said.get(), text.data(), text.size(), 0) != file.st_size) {
    return failure(ErrorCode::system, "read what was measured", errno);
  }
  return rows_of(text);
}

}  // namespace plchost::bench
