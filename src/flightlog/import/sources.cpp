#include "flightlog/import/sources.hpp"

#include <algorithm>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "flightlog/import/c3d.hpp"
#include "flightlog/import/dataflash.hpp"
#include "flightlog/import/gzip.hpp"
#include "flightlog/import/matlab.hpp"
#include "flightlog/import/message_rows.hpp"
#include "flightlog/import/sparse_points.hpp"
#include "flightlog/import/table.hpp"
#include "flightlog/import/ulog.hpp"
#include "flightlog/import/usdlog.hpp"
#include "flightlog/ros/bag.hpp"
#include "io/files.hpp"
#include "io/mapped_file.hpp"
#include "io/text.hpp"

namespace flappy::flightlog {
namespace {

namespace fs = std::filesystem;

void read_bag(const fs::path& file, Channels& channels, std::vector<std::string>& warnings) {
  struct Reader {
    std::optional<MessageRows> rows;  ///< none where messages are not wanted or cannot be read
    std::size_t bad = 0;
    std::string first_fault;
  };
  const auto bag = ros::Bag::open(file);
  std::set<std::string> faulty;                    // warned of once, although each part of a bag has own topics
  std::map<const ros::BagTopic*, Reader> readers;  // by address, because two topics may share a name but differ in type
  const auto warn = [&](const ros::BagTopic& topic, const std::string& what) {
    warnings.push_back(file.string() + ": " + io::shortened(topic.name) + ": " + what);
  };
  while (const auto message = bag->next()) {
    const ros::BagTopic& topic = *message->topic;
    auto found = readers.find(&topic);
    if (found == readers.end()) {
      found = readers.try_emplace(&topic).first;
      if (channels.wants(topic.name)) try {
          found->second.rows.emplace(ros::layout_of(topic));
        } catch (const ros::MessageError& error) {
          if (faulty.insert(topic.name).second) warn(topic, std::string(error.what()) + ": left out");
        }
    }
    Reader& reader = found->second;
    if (!reader.rows) continue;
    try {
      const Row& row = reader.rows->read(message->bytes);
      if (!row.empty()) channels.add(topic.name, message->received_ns, reader.rows->stamp_ns(), row);
    } catch (const ros::MessageError& error) {
      if (reader.bad++ == 0) reader.first_fault = error.what();
    }
  }
  for (const std::string& topic : bag->topics()) channels.add(topic);
  for (const std::string& warning : bag->warnings()) warnings.push_back(warning);
  for (const auto& [topic, reader] : readers)
    if (reader.bad > 0)
      warn(*topic, std::to_string(reader.bad) + " messages left out, the first because " + reader.first_fault);
}

/// Foreign formats that users try to import.
struct OtherKind {
  std::string_view begins;
  std::size_t at;  ///< offset of `begins` in the file
  std::initializer_list<std::string_view> endings;
  std::string_view what, remedy;
};

using namespace std::string_view_literals;
const OtherKind kOtherKinds[] = {
    {"\x89MCAP0\r\n"sv,
     0,
     {".mcap"},
     "a bag compressed by gzip",
     "gunzip FILE"},  // uncompressed ones were recognised by Bag::is_bag
    {"SQLite format 3\0"sv, 0, {".db3"}, "a bag compressed by gzip", "gunzip FILE"},
    {"#ROSBAG V"sv, 0, {".bag"}, "a bag of ROS 1", "rosbags-convert --src FILE --dst FOLDER"},
    {"\x28\xB5\x2F\xFD"sv, 0, {".zst", ".zstd"}, "compressed by zstd", "zstd -d FILE"},
    {"\x04\x22\x4D\x18"sv, 0, {".lz4"}, "compressed by lz4", "lz4 -d FILE"},
    {"\xFD"
     "7zXZ\0"sv,
     0,
     {".xz"},
     "compressed by xz",
     "unxz FILE"},
    {"1AY&SY"sv, 4, {".bz2"}, "compressed by bzip2", "bunzip2 FILE"},
    {"PK\x03\x04"sv,
     0,
     {".zip", ".npz", ".xlsx", ".ods"},
     "a zip archive, as .npz and .xlsx files are",
     "unzip FILE, or export it as CSV"},
    {"7z\xBC\xAF\x27\x1C"sv, 0, {".7z"}, "a 7z archive", "7z x FILE"},
    {"ustar"sv, 257, {".tar", ".tgz"}, "a tar archive", "tar xf FILE"},
    {"\x89HDF\r\n"sv, 0, {".h5", ".hdf5"}, "an HDF5 file", "export it as CSV"},
    {"MATLAB "sv, 0, {".mat"}, "a MATLAB file compressed by gzip", "gunzip FILE"},  // plain ones were recognised before
    {"# Created by Octave"sv, 0, {}, "a text file of Octave", "save -v7 FILE"},
    {"PAR1"sv, 0, {".parquet"}, "a Parquet file", "pandas.read_parquet(FILE).to_csv(...)"},
    {"\x93NUMPY"sv, 0, {".npy"}, "a NumPy array", "numpy.savetxt with header= and delimiter=\",\""},
    {"H Product:Blackbox flight data recorder"sv,
     0,
     {".bbl", ".bfl"},
     "a blackbox log of Betaflight or INAV",
     "blackbox_decode FILE, of that firmware's blackbox-tools"},
    {"TDSm"sv,
     0,
     {".tdms"},
     "a TDMS file of LabVIEW",
     "nptdms.TdmsFile.read(FILE)[GROUP].as_dataframe(time_index=True).to_csv(\"forces.csv\", index_label=\"time\")"},
    {"TDSh"sv, 0, {".tdms_index"}, "the index of a TDMS file", "the same of the .tdms file"},
    {"\xD0\xCF\x11\xE0"sv, 0, {".xls"}, "an Excel file", "export it as CSV"},
    {"\xFF\xFE"sv, 0, {}, "text in UTF-16", "iconv -f UTF-16 -t UTF-8 FILE"},
    {"\xFE\xFF"sv, 0, {}, "text in UTF-16", "iconv -f UTF-16 -t UTF-8 FILE"},
};

/// In small letters, as cards name their files in capitals.
std::string in_small_letters(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

/// InputError for files that are no text, recognised by their first bytes or by the ending of their names.
void require_text(const fs::path& file, const std::string& ending, std::string_view bytes) {
  constexpr std::string_view kAccepted = "a bag, a ULog, a usdlog, a log of ArduPilot, a MATLAB file, a C3D or a CSV";
  for (const OtherKind& kind : kOtherKinds)
    if (bytes.substr(std::min(kind.at, bytes.size())).starts_with(kind.begins))
      throw io::InputError(file.string() + ": is " + std::string(kind.what) + "; accepted: " + std::string(kAccepted) +
                           ", as made by: " + std::string(kind.remedy));
  if (is_matlab_4(bytes))
    throw io::InputError(file.string() + ": is a MATLAB file of version 4; accepted: " + std::string(kAccepted) +
                         ", as made by: save with -v7");
  std::vector<std::string_view> named = {".ulg", ".c3d"};
  for (const OtherKind& kind : kOtherKinds) named.insert(named.end(), kind.endings);
  if (std::ranges::find(named, ending) != named.end())
    throw io::InputError(file.string() + ": does not begin as a " + ending +
                         " file; accepted: " + std::string(kAccepted));
  constexpr std::size_t kLooked = 4096;
  if (bytes.substr(0, kLooked).find('\0') != std::string_view::npos)
    throw io::InputError(file.string() + ": holds bytes that are no text; accepted: " + std::string(kAccepted));
}

/// Reads a file that is neither a bag nor of MATLAB; `plain` is its name without ".gz".
void read_bytes(const fs::path& file, const fs::path& plain, std::string_view bytes, Channels& channels,
                std::vector<std::string>& warnings) {
  if (is_ulog(bytes)) return read_ulog(bytes, file.string(), channels, warnings);
  if (is_usdlog(bytes)) return read_usdlog(bytes, file.string(), channels, warnings);
  if (is_dataflash(bytes)) return read_dataflash(bytes, file.string(), channels, warnings);
  if (is_dataflash_text(bytes)) return read_dataflash_text(bytes, file.string(), channels, warnings);
  if (is_c3d(bytes)) return read_c3d(bytes, file.string(), plain.stem().string(), channels, warnings);
  require_text(file, in_small_letters(plain.extension().string()), bytes);
  if (is_sparse_points(bytes))
    return read_sparse_points(bytes, file.string(), plain.stem().string(), channels, warnings);
  read_table(bytes, file.string(), plain.stem().string(), channels, warnings);
}

}  // namespace

void read_source(const fs::path& file, Channels& channels, std::vector<std::string>& warnings) {
  std::error_code ignored;
  if (fs::is_directory(file, ignored) || ros::Bag::is_bag(file)) return read_bag(file, channels, warnings);
  const io::MappedFile mapped(file);
  if (is_matlab(mapped.bytes())) return read_matlab(file, mapped.bytes(), channels, warnings);
  if (!is_gzip(mapped.bytes())) return read_bytes(file, file, mapped.bytes(), channels, warnings);
  const std::string unpacked = gunzipped(mapped.bytes(), file.string(), warnings);
  read_bytes(file, file.extension() == ".gz" ? file.stem() : file, unpacked, channels, warnings);
}

}  // namespace flappy::flightlog
