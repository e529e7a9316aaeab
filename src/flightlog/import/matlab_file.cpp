// The plugin that reads MATLAB files: version 5 to 7 by libmatio [1], 7.3, which is HDF5, by its C library: of class
// names that are padded by zeros, as h5py writes them, libmatio 1.5.23 drops the last letter, and numbers come as
// nothing.
// [1] MathWorks, MAT-File Format: elements of a type, a size and that many bytes.
#include "flightlog/import/matlab_file.hpp"

#include <hdf5.h>
#include <matio.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>

#include "flightlog/import/bytes.hpp"
#include "io/files.hpp"
#include "io/text.hpp"

namespace flappy::flightlog {
namespace {

constexpr std::size_t kDeepest = 16;        // structs in structs
constexpr std::size_t kMaxArrays = 100000;  // names that one file may have

using Functions = MatlabFunctions;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw io::InputError(path + ": " + what + "; accepted: what save of MATLAB wrote");
}

/// Counts names, because a damaged file may name one thing without end.
class Names {
 public:
  explicit Names(const std::string& path) : path_(path) {}
  void count(std::size_t depth) {
    if (depth > kDeepest || ++count_ > kMaxArrays)
      refuse(path_, "holds structs deeper than " + std::to_string(kDeepest) + " or more than " +
                        std::to_string(kMaxArrays) + " arrays");
  }

 private:
  const std::string& path_;
  std::size_t count_ = 0;
};

std::string indexed(const std::string& name, std::size_t k) { return name + "[" + std::to_string(k) + "]"; }

// ---- version 5 to 7

constexpr std::size_t kHeader = 128, kTag = 8, kByteOrder = 126;
constexpr std::uint32_t kMatrix = 14, kCompressed = 15, kSmallest = 16;
constexpr std::uint32_t kOpaque = 17;  // class of datetime, table, string, timeseries

/// A variable as its element says before libmatio reads it.
struct Element {
  std::string name, object;  ///< `object`: the class of one that is no plain array
  bool sound = true;
};

/// The elements of a file. libmatio does not say which it skips, nor checks the sums of compressed ones.
class Elements {
 public:
  Elements(std::string_view bytes, MatlabSink& sink)
      : bytes_(bytes), swapped_(bytes.substr(kByteOrder, 2) == "MI"), sink_(sink) {}

  std::vector<Element> read() {
    std::vector<Element> found;
    for (std::size_t at = kHeader; at < bytes_.size();) {
      const std::size_t left = bytes_.size() - at;
      const std::uint32_t type = left < kTag ? kMatrix : word(bytes_, at);
      const std::size_t size = left < kTag ? left : word(bytes_, at + 4);
      if (type != kMatrix && type != kCompressed) return stop(found, "has no variable", at);
      if (left < kTag || size > left - kTag) return stop(found, "ends within a variable", at);
      Element element;
      const std::string_view content = bytes_.substr(at + kTag, size);
      element.sound = type == kMatrix ? describe(content, element) : inflated(content, element);
      found.push_back(element);
      at += kTag + size;
    }
    return found;
  }

 private:
  std::vector<Element> stop(const std::vector<Element>& found, const std::string& what, std::size_t at) {
    sink_.warn(what + " at byte " + std::to_string(at) + ": read as far as it goes");
    return found;
  }

  std::uint32_t word(std::string_view bytes, std::size_t at) const {
    const auto value = number_at<std::uint32_t>(bytes.data() + at);
    return swapped_ ? __builtin_bswap32(value) : value;
  }

  /// The next element within a matrix; a small one has its size and bytes in its tag.
  std::optional<std::string_view> part(std::string_view& rest) const {
    if (rest.size() < kTag) return std::nullopt;
    const std::uint32_t type = word(rest, 0), small = type >> kSmallest;
    std::string_view content;
    if (small > 0) {
      if (small > 4) return std::nullopt;
      content = rest.substr(4, small);
      rest.remove_prefix(kTag);
      return content;
    }
    const std::size_t size = word(rest, 4);
    if (size > rest.size() - kTag) return std::nullopt;
    content = rest.substr(kTag, size);
    rest.remove_prefix(std::min(rest.size(), kTag + (size + 7) / 8 * 8));
    return content;
  }

  /// Name and class of a matrix, of which `content` may be the beginning alone.
  bool describe(std::string_view content, Element& element) const {
    const auto flags = part(content);
    if (!flags || flags->size() < 4) return false;
    if ((word(*flags, 0) & 0xff) == kOpaque) {
      const auto name = part(content);
      part(content);  // "MCOS", "java"
      const auto kind = part(content);
      if (!name || !kind) return false;
      element.name = *name, element.object = *kind;
      return true;
    }
    part(content);  // sizes
    const auto name = part(content);
    if (!name) return false;
    element.name = *name;
    return true;
  }

  /// describe() for a compressed variable, whose sum is checked.
  bool inflated(std::string_view packed, Element& element) const {
    z_stream stream = {};
    if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
    const std::unique_ptr<z_stream, decltype(&inflateEnd)> guard(&stream, inflateEnd);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
    stream.avail_in = static_cast<uInt>(packed.size());
    std::array<char, 1 << 16> block;
    bool described = false, first = true;
    int result = Z_OK;
    while (result == Z_OK) {
      stream.next_out = reinterpret_cast<Bytef*>(block.data());
      stream.avail_out = block.size();
      result = inflate(&stream, Z_NO_FLUSH);
      const std::string_view head(block.data(), block.size() - stream.avail_out);
      if (first && head.size() > kTag) described = describe(head.substr(kTag), element);
      first = false;
    }
    return described && result == Z_STREAM_END;
  }

  std::string_view bytes_;
  bool swapped_;
  MatlabSink& sink_;
};

template <class T>
void copy_as(const matvar_t& v, std::vector<double>& values) {
  const T* from = static_cast<const T*>(v.data);
  values.assign(from, from + v.nbytes / sizeof(T));
}

/// The numbers of an array; false where it holds none.
bool numbers_of(const matvar_t& v, std::vector<double>& values) {
  switch (v.data_type) {
    case MAT_T_DOUBLE:
      copy_as<double>(v, values);
      return true;
    case MAT_T_SINGLE:
      copy_as<float>(v, values);
      return true;
    case MAT_T_INT8:
      copy_as<std::int8_t>(v, values);
      return true;
    case MAT_T_UINT8:
      copy_as<std::uint8_t>(v, values);
      return true;
    case MAT_T_INT16:
      copy_as<std::int16_t>(v, values);
      return true;
    case MAT_T_UINT16:
      copy_as<std::uint16_t>(v, values);
      return true;
    case MAT_T_INT32:
      copy_as<std::int32_t>(v, values);
      return true;
    case MAT_T_UINT32:
      copy_as<std::uint32_t>(v, values);
      return true;
    case MAT_T_INT64:
      copy_as<std::int64_t>(v, values);
      return true;
    case MAT_T_UINT64:
      copy_as<std::uint64_t>(v, values);
      return true;
    default:
      return false;
  }
}

class Version5 {
 public:
  Version5(const std::string& path, MatlabSink& sink) : path_(path), sink_(sink), names_(path) {}

  void read(std::string_view bytes) {
    if (bytes.size() < kHeader) refuse(path_, "ends within its head");
    const std::vector<Element> elements = Elements(bytes, sink_).read();
    Mat_LogInitFunc("", [](int, char*) {});  // it would print; what it skips, the elements tell
    const std::unique_ptr<mat_t, decltype(&Mat_Close)> file(Mat_Open(path_.c_str(), MAT_ACC_RDONLY), Mat_Close);
    if (!file) refuse(path_, "has a damaged head");
    for (const Element& element : elements) {
      using Variable = std::unique_ptr<matvar_t, decltype(&Mat_VarFree)>;
      const bool plain = element.sound && element.object.empty();
      const Variable variable((plain ? Mat_VarReadNext : Mat_VarReadNextInfo)(file.get()), Mat_VarFree);
      if (!element.sound) {
        sink_.warn(shown(element.name) + " is damaged: left out");
      } else if (!element.object.empty()) {
        sink_.leave_out(element.name, element.object);
      } else if (element.name.empty()) {
        continue;  // what the objects hold
      } else if (!variable || !variable->name || element.name != variable->name) {
        return sink_.warn(shown(element.name) + " is damaged: left out, and all that follows");
      } else {
        visit(*variable, element.name, 0);
      }
    }
  }

 private:
  static std::string shown(const std::string& name) {
    return name.empty() ? "a variable without a name" : io::shortened(name);
  }

  void visit(matvar_t& v, const std::string& name, std::size_t depth) {
    names_.count(depth);
    std::size_t count = 1;
    MatlabArray array{name, {}};
    for (int k = 0; k < v.rank; ++k) {
      array.sizes.push_back(v.dims[k]);
      if (__builtin_mul_overflow(count, v.dims[k], &count)) return damaged(name);
    }
    if (v.rank == 0) return sink_.leave_out(name, "object");
    if (count == 0) return;
    switch (v.class_type) {
      case MAT_C_STRUCT:
        return visit_structs(v, name, count, depth);
      case MAT_C_CHAR:
        return;  // text about the numbers
      case MAT_C_CELL:
        return sink_.leave_out(name, "cell");
      case MAT_C_SPARSE:
        return sink_.leave_out(name, "sparse");
      case MAT_C_FUNCTION:
        return sink_.leave_out(name, "function_handle");
      case MAT_C_OBJECT:
      case MAT_C_OPAQUE:
        return sink_.leave_out(name, "object");
      default:
        break;
    }
    if (v.isComplex) return sink_.leave_out(name, "complex");
    std::vector<double> values;
    if (!v.data || !numbers_of(v, values) || values.size() != count) return damaged(name);
    sink_.take(array, values);
  }

  void visit_structs(matvar_t& v, const std::string& name, std::size_t count, std::size_t depth) {
    const unsigned fields = Mat_VarGetNumberOfFields(&v);
    char* const* names = Mat_VarGetStructFieldnames(&v);
    if (!v.data || (fields > 0 && !names)) return damaged(name);
    for (std::size_t k = 0; k < count; ++k)
      for (unsigned f = 0; f < fields; ++f) {
        const std::string full = (count > 1 ? indexed(name, k) : name) + "." + names[f];
        matvar_t* field = Mat_VarGetStructFieldByIndex(&v, f, k);
        if (!field) damaged(full);
        else visit(*field, full, depth + 1);
      }
  }

  void damaged(const std::string& name) { sink_.warn(io::shortened(name) + " is damaged: left out"); }

  const std::string& path_;
  MatlabSink& sink_;
  Names names_;
};

// ---- version 7.3

/// An identifier of HDF5 that is closed in the end.
class Id {
 public:
  Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Id() {
    if (id_ >= 0) close_(id_);
  }
  Id(const Id&) = delete;
  Id& operator=(const Id&) = delete;
  operator hid_t() const { return id_; }  // NOLINT(google-explicit-constructor): it stands for it
  bool valid() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

class Version73 {
 public:
  Version73(const std::string& path, std::size_t file_size, MatlabSink& sink)
      : path_(path), max_count_(kLargestFactor * file_size), sink_(sink), names_(path) {}

  void read() {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    H5PLset_loading_state(0);  // a file must not choose code that is run
    const Id file(H5Fopen(path_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    if (!file.valid()) refuse(path_, "is damaged or was cut off");
    visit_members(file, "", 0);
  }

 private:
  void visit(hid_t object, const std::string& name, std::size_t depth) {
    names_.count(depth);
    const std::string kind = text_of(object, "MATLAB_class");
    if (H5Iget_type(object) == H5I_GROUP) {
      if (has(object, "MATLAB_sparse")) return sink_.leave_out(name, "sparse");
      if (!kind.empty() && kind != "struct") return sink_.leave_out(name, kind);
      return visit_members(object, name + ".", depth + 1);
    }
    if (H5Iget_type(object) != H5I_DATASET) return sink_.leave_out(name, "no array");
    if (has(object, "MATLAB_empty") || kind == "char") return;
    const Id type(H5Dget_type(object), H5Tclose), space(H5Dget_space(object), H5Sclose);
    const H5T_class_t stored = H5Tget_class(type);
    const int rank = H5Sget_simple_extent_ndims(space);
    if (!type.valid() || rank < 0 || rank > H5S_MAX_RANK) return damaged(name);
    std::vector<hsize_t> sizes(static_cast<std::size_t>(rank));
    if (rank > 0) H5Sget_simple_extent_dims(space, sizes.data(), nullptr);
    if (stored == H5T_REFERENCE && kind.empty()) return visit_references(object, name, space, depth);
    const bool object_of_class = has(object, "MATLAB_object_decode") || (!kind.empty() && !is_numeric(kind));
    if (object_of_class) return sink_.leave_out(name, kind.empty() ? "object" : kind);
    if (stored == H5T_COMPOUND) return sink_.leave_out(name, "complex");
    if (stored != H5T_INTEGER && stored != H5T_FLOAT) return sink_.leave_out(name, "no numbers");
    take(object, {name, {sizes.rbegin(), sizes.rend()}});
  }

  void take(hid_t data, MatlabArray array) {
    if (array.sizes.empty()) array.sizes = {1};
    std::size_t count = 1;
    for (const std::size_t size : array.sizes)
      if (__builtin_mul_overflow(count, size, &count) || count > max_count_) return damaged(array.name);
    std::vector<double> values;
    if (count > 0 && sink_.wants(array)) {
      values.resize(count);
      if (H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
        return damaged(array.name);
    }
    sink_.take(array, values);
  }

  void visit_members(hid_t group, const std::string& prefix, std::size_t depth) {
    struct Found {
      std::vector<std::string> names;
      static herr_t add(hid_t, const char* name, const H5L_info_t* link, void* found) {
        // others lead out of the file, or nowhere
        if (link->type == H5L_TYPE_HARD) static_cast<Found*>(found)->names.emplace_back(name);
        return 0;
      }
    } found;
    if (H5Literate(group, H5_INDEX_NAME, H5_ITER_INC, nullptr, &Found::add, &found) < 0)
      sink_.warn((prefix.empty() ? "the list of its variables" : io::shortened(prefix + "...")) +
                 " is damaged: read as far as it goes");
    for (const std::string& name : found.names) {
      if (prefix.empty() && name.starts_with('#')) continue;  // what cells and objects hold
      const Id object(H5Oopen(group, name.c_str(), H5P_DEFAULT), H5Oclose);
      if (object.valid()) visit(object, prefix + name, depth);
      else damaged(prefix + name);
    }
  }

  /// A field of an array of structs: "trial.t" refers to trial[0].t, trial[1].t, ...
  void visit_references(hid_t object, const std::string& name, hid_t space, std::size_t depth) {
    const hssize_t count = H5Sget_simple_extent_npoints(space);
    if (count < 0 || static_cast<std::size_t>(count) > kMaxArrays) return damaged(name);
    std::vector<hobj_ref_t> references(static_cast<std::size_t>(count));
    if (count == 0) return;
    if (H5Dread(object, H5T_STD_REF_OBJ, H5S_ALL, H5S_ALL, H5P_DEFAULT, references.data()) < 0) return damaged(name);
    const std::size_t dot = name.rfind('.');
    for (std::size_t k = 0; k < references.size(); ++k) {
      const std::string full =
          dot == std::string::npos ? indexed(name, k) : indexed(name.substr(0, dot), k) + name.substr(dot);
      const Id target(H5Rdereference2(object, H5P_DEFAULT, H5R_OBJECT, &references[k]), H5Oclose);
      if (target.valid()) visit(target, full, depth + 1);
      else damaged(full);
    }
  }

  static bool has(hid_t object, const char* attribute) { return H5Aexists(object, attribute) > 0; }

  /// A text of fixed size, in whatever way it is padded; empty where there is none.
  static std::string text_of(hid_t object, const char* attribute) {
    constexpr std::size_t kLongest = 256;
    if (!has(object, attribute)) return "";
    const Id opened(H5Aopen(object, attribute, H5P_DEFAULT), H5Aclose);
    const Id type(H5Aget_type(opened), H5Tclose), space(H5Aget_space(opened), H5Sclose);
    if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || H5Sget_simple_extent_npoints(space) != 1)
      return "object";
    std::string text(H5Tget_size(type), '\0');
    if (text.size() > kLongest || H5Aread(opened, type, text.data()) < 0) return "object";
    return text.substr(0, text.find('\0'));
  }

  static bool is_numeric(const std::string& kind) {
    constexpr std::array<std::string_view, 11> kNumeric = {"double", "single", "logical", "int8",  "uint8", "int16",
                                                           "uint16", "int32",  "uint32",  "int64", "uint64"};
    return std::ranges::find(kNumeric, kind) != kNumeric.end();
  }

  void damaged(const std::string& name) { sink_.warn(io::shortened(name) + " is damaged: left out"); }

  static constexpr std::size_t kLargestFactor = 1032;  // of deflate: so many bytes of a byte

  const std::string& path_;
  std::size_t max_count_;  ///< numbers that a file of its size can hold
  MatlabSink& sink_;
  Names names_;
};

void read(const std::string& path, std::string_view bytes, MatlabSink& sink) {
  constexpr std::string_view kHdf5("\x89HDF\r\n\x1a\n", 8);
  constexpr std::size_t kUserBlock = 512;  // MATLAB's head
  if (bytes.substr(std::min(kUserBlock, bytes.size())).starts_with(kHdf5)) Version73(path, bytes.size(), sink).read();
  else Version5(path, sink).read(bytes);
}

}  // namespace

const MatlabFunctions flappy_matlab_functions = {read};

}  // namespace flappy::flightlog
