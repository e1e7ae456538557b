#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include <pybind11/chrono.h>
#include <pybind11/functional.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "api/plchost_client.hpp"

namespace plchost::python {

namespace py = pybind11;

/// Texts of hosts are cut at their bounds, also within a character: that must not cost the whole list.
struct ToPython {
  py::object operator()(const std::string& text) const {
    return py::reinterpret_steal<py::object>(
        PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "replace"));
  }
  template <class Number>
  py::object operator()(Number number) const {
    return py::cast(number);
  }
};

using NoGil = py::call_guard<py::gil_scoped_release>;

// Those that are there. When Python ends they are closed before: a thread that waits for Python then would be
// ended where it stands.
class Clients {
 public:
  void add(Client* client) {
    const std::lock_guard lock(mutex_);
    clients_.insert(client);
  }
  void remove(Client* client) {
    const std::lock_guard lock(mutex_);
    clients_.erase(client);
  }
  void close() {
    const std::lock_guard lock(mutex_);
    for (Client* client : clients_) client->close();
  }

 private:
  std::mutex mutex_;
  std::set<Client*> clients_;
};

inline Clients& clients() {
  static Clients all;
  return all;
}

// A destructor that waits for a callback must let that callback have Python.
struct DeleteWithoutGil {
  template <class T>
  void operator()(T* object) const {
    const py::gil_scoped_release release;
    if constexpr (std::is_same_v<T, Client>) clients().remove(object);
    delete object;
  }
};
template <class T>
using Holder = std::unique_ptr<T, DeleteWithoutGil>;

inline py::dict dict_of(const Client::Record& record) {
  py::dict members;
  for (const auto& [name, value] : record) members[name.c_str()] = std::visit(ToPython(), value);
  return members;
}

template <class Item>
const Item& to_argument(const Item& item) {
  return item;  // NOLINT(bugprone-return-const-ref-from-parameter): within the call that it is an argument of
}
inline py::dict to_argument(const Client::Record& record) {
  return dict_of(record);
}

// An exception of a callback has no receiver: Python writes it to stderr, as for threads.
template <class Item>
std::function<void(const Item&)> guarded(py::function callback) {
  // The last reference may go on a thread of the library.
  const std::shared_ptr<py::function> kept(new py::function(std::move(callback)), [](py::function* function) {
    const py::gil_scoped_acquire gil;
    delete function;
  });
  return [kept](const Item& item) {
    const py::gil_scoped_acquire gil;
    try {
      (*kept)(to_argument(item));
    } catch (py::error_already_set& raised) {
      raised.discard_as_unraisable("a callback of plchost_client");
    }
  };
}

}  // namespace plchost::python
