#include "api/security/openssl.hpp"

#include <array>
#include <new>

#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/err.h>

namespace plchost::security {

std::unexpected<Error> openssl_failure(std::string_view step, ErrorCode code) {
  std::array<char, 256> reason{};
  if (const unsigned long number = ERR_peek_last_error(); number != 0) {
    ERR_error_string_n(number, reason.data(), reason.size());
  }
  ERR_clear_error();
  const std::string_view text(reason.data());
  return failure(code, text.empty() ? std::string(step) : fmt::format("{}: {}", step, text));
}

Bio reading_bio(std::string_view text) {
  Bio bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
  if (!bio) throw std::bad_alloc();
  return bio;
}

Bio writing_bio() {
  Bio bio(BIO_new(BIO_s_mem()));
  if (!bio) throw std::bad_alloc();
  return bio;
}

std::string text_of(const Bio& bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio.get(), &data);  // NOLINT(cppcoreguidelines-pro-type-cstyle-cast)
  return {data, static_cast<std::size_t>(size > 0 ? size : 0)};
}

}  // namespace plchost::security
