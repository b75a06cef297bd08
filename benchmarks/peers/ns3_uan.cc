// The acoustics of a mission in ns-3's UAN module: who hears which ping, whom a frame reaches.
//
// usage: ns3_uan TRAFFIC RECEPTIONS [listeners]
//
// TRAFFIC is what benchmarks/peers/traffic.py writes.  Two channels, HF and MF; a node of each AUV
// and ASV on both.  With "listeners" a channel brings a signal to those only that listen to it
// (ASVs on HF, AUVs on MF), which spares ns-3 most of its events; without, to all, as ns-3 does.
// Prints "SETUP_MS RUN_MS EVENTS", in processor time; RECEPTIONS gets a line "hf PING ASV" or "mf BROADCAST AUV" each.

#include <cmath>
#include <cstdint>
#include <ctime>
#include <fstream>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "ns3/core-module.h"
#include "ns3/mobility-module.h"
#include "ns3/network-module.h"
#include "ns3/uan-module.h"

using namespace ns3;

// A signal out of range arrives this much weaker (dB), and is neither heard nor disturbs.
constexpr double kSilent = 1000.0;

// A run longer than this (ms) is not repeated to be warm.
constexpr double kLongestWarmUpMs = 5000.0;

// Sound spreads at a constant speed and is equally loud up to a horizontal range.
class RangeLimited : public UanPropModel {
  public:
    RangeLimited(double range, double soundSpeed) : m_square(range * range), m_speed(soundSpeed) {}

    double GetPathLossDb(Ptr<MobilityModel> a, Ptr<MobilityModel> b, UanTxMode) override {
        const Vector p = a->GetPosition(), q = b->GetPosition();
        const double x = p.x - q.x, y = p.y - q.y;
        return x * x + y * y <= m_square ? 0.0 : kSilent;
    }
    UanPdp GetPdp(Ptr<MobilityModel>, Ptr<MobilityModel>, UanTxMode) override {
        return UanPdp::CreateImpulsePdp();
    }
    Time GetDelay(Ptr<MobilityModel> a, Ptr<MobilityModel> b, UanTxMode) override {
        return Seconds(a->GetDistanceFrom(b) / m_speed);
    }

  private:
    double m_square, m_speed;
};

// A channel that brings signals to some of its devices only.
class ListenersOnly : public UanChannel {
  public:
    void Listen(uint32_t device) { m_listeners.push_back(device); }

    void TxPacket(Ptr<UanTransducer> source, Ptr<Packet> packet, double power,
                  UanTxMode mode) override {
        Ptr<MobilityModel> sender;
        for (const auto& [device, transducer] : m_devList) {
            if (transducer == source) {
                sender = device->GetNode()->GetObject<MobilityModel>();
                break;
            }
        }
        for (uint32_t i : m_listeners) {
            const auto& [device, transducer] = m_devList[i];
            Ptr<MobilityModel> place = device->GetNode()->GetObject<MobilityModel>();
            const double loss = m_prop->GetPathLossDb(sender, place, mode);
            if (transducer == source || loss >= kSilent) {
                continue;
            }
            Simulator::ScheduleWithContext(device->GetNode()->GetId(),
                                           m_prop->GetDelay(sender, place, mode),
                                           &ListenersOnly::Bring, this, i, packet->Copy(),
                                           power - loss, mode);
        }
    }

  private:
    void Bring(uint32_t i, Ptr<Packet> packet, double power, UanTxMode mode) {
        SendUp(i, packet, power, mode, UanPdp::CreateImpulsePdp());
    }
    std::vector<uint32_t> m_listeners;
};

struct Moved {
    uint32_t node;
    Vector position;
};

// A ping (HF) or a frame (MF): who sends it when, how long, and where vehicles are by then.
struct Transmission {
    double at;
    uint32_t sender, number, bytes;
    std::vector<Moved> moved;
};

struct Reception {
    uint64_t packet;
    uint32_t node;
};

struct Band {
    std::string name;
    double range, bytesPerSecond;
    std::vector<Transmission> transmissions;
    std::vector<std::pair<uint64_t, uint32_t>> numbers; // packet -> ping or broadcast
    std::vector<Reception> receptions;
    NetDeviceContainer devices;
};

struct Traffic {
    uint32_t auvs = 0, asvs = 0;
    double soundSpeed = 0;
    std::vector<Vector> places;
    Band bands[2];
};

Traffic Read(const std::string& path) {
    std::ifstream file(path);
    Traffic traffic;
    std::string word;
    file >> word >> traffic.auvs >> traffic.asvs >> traffic.soundSpeed;
    for (Band& band : traffic.bands) {
        file >> band.name >> band.range >> band.bytesPerSecond;
    }
    traffic.places.resize(traffic.auvs + traffic.asvs);
    for (Vector& place : traffic.places) {
        file >> word >> place.x >> place.y >> place.z;
    }
    size_t moved = 0;
    for (std::string band; file >> band;) {
        Transmission sent;
        file >> sent.number >> sent.at >> sent.sender >> sent.bytes >> moved;
        sent.moved.resize(moved);
        for (Moved& vehicle : sent.moved) {
            file >> vehicle.node >> vehicle.position.x >> vehicle.position.y >> vehicle.position.z;
        }
        traffic.bands[band == "hf" ? 0 : 1].transmissions.push_back(sent);
    }
    if (!file.eof() || traffic.soundSpeed <= 0) {
        std::cerr << path << ": not a traffic file\n";
        std::exit(2);
    }
    return traffic;
}

void Send(Band* band, const NodeContainer* nodes, const Transmission* sent) {
    for (const Moved& vehicle : sent->moved) {
        nodes->Get(vehicle.node)->GetObject<MobilityModel>()->SetPosition(vehicle.position);
    }
    Ptr<Packet> packet = Create<Packet>(sent->bytes);
    band->numbers.emplace_back(packet->GetUid(), sent->number);
    DynamicCast<UanNetDevice>(band->devices.Get(sent->sender))->GetPhy()->SendPacket(packet, 0);
}

void Hear(Band* band, uint32_t node, Ptr<Packet> packet, double, UanTxMode) {
    band->receptions.push_back({packet->GetUid(), node});
}

void Build(Traffic& traffic, NodeContainer& nodes, bool listenersOnly) {
    nodes.Create(traffic.auvs + traffic.asvs);
    for (uint32_t node = 0; node < nodes.GetN(); ++node) {
        Ptr<ConstantPositionMobilityModel> mobility = CreateObject<ConstantPositionMobilityModel>();
        mobility->SetPosition(traffic.places[node]);
        nodes.Get(node)->AggregateObject(mobility);
    }
    for (Band& band : traffic.bands) {
        UanModesList modes;
        modes.AppendMode(UanTxModeFactory::CreateMode(
            UanTxMode::FSK, static_cast<uint32_t>(std::lround(8 * band.bytesPerSecond)), 1000,
            25000, 10000, 2, band.name));
        UanHelper helper;
        helper.SetPhy("ns3::UanPhyGen", "SupportedModes", UanModesListValue(modes));
        Ptr<ListenersOnly> few = CreateObject<ListenersOnly>();
        Ptr<UanChannel> channel = few;
        if (!listenersOnly) {
            channel = CreateObject<UanChannel>();
        }
        channel->SetPropagationModel(CreateObject<RangeLimited>(band.range, traffic.soundSpeed));
        channel->SetNoiseModel(CreateObject<UanNoiseModelDefault>());
        band.devices = helper.Install(nodes, channel);
        for (uint32_t node = 0; node < nodes.GetN(); ++node) {
            const bool isAsv = node >= traffic.auvs;
            if ((band.name == "hf") == isAsv) {
                few->Listen(node);
            }
            DynamicCast<UanNetDevice>(band.devices.Get(node))
                ->GetPhy()
                ->SetReceiveOkCallback(MakeBoundCallback(&Hear, &band, node));
        }
        for (const Transmission& sent : band.transmissions) {
            Simulator::Schedule(Seconds(sent.at), &Send, &band, &nodes, &sent);
        }
    }
}

void Write(const Traffic& traffic, const std::string& path) {
    std::ofstream file(path);
    for (const Band& band : traffic.bands) {
        std::map<uint64_t, uint32_t> numbers(band.numbers.begin(), band.numbers.end());
        for (const Reception& reception : band.receptions) {
            const bool isAsv = reception.node >= traffic.auvs;
            if ((band.name == "hf") == isAsv) {
                file << band.name << ' ' << numbers.at(reception.packet) << ' '
                     << (isAsv ? reception.node - traffic.auvs : reception.node) << '\n';
            }
        }
    }
}

struct Timed {
    double setUpMs, runMs;
    uint64_t events;
};

Timed Simulate(Traffic& traffic, bool listenersOnly) {
    for (Band& band : traffic.bands) {
        band.numbers.clear();
        band.receptions.clear();
        band.devices = NetDeviceContainer();
    }
    const std::clock_t began = std::clock();
    NodeContainer nodes;
    Build(traffic, nodes, listenersOnly);
    const std::clock_t built = std::clock();
    Simulator::Run();
    const std::clock_t ended = std::clock();
    const uint64_t events = Simulator::GetEventCount();
    Simulator::Destroy();
    constexpr double ms = CLOCKS_PER_SEC / 1000.0;
    return {(built - began) / ms, (ended - built) / ms, events};
}

int main(int argc, char* argv[]) {
    if (argc < 3) {
        std::cerr << "usage: ns3_uan TRAFFIC RECEPTIONS [listeners]\n";
        return 2;
    }
    Traffic traffic = Read(argv[1]);
    const bool listenersOnly = argc > 3 && std::string(argv[3]) == "listeners";
    Timed timed = Simulate(traffic, listenersOnly);
    if (timed.runMs < kLongestWarmUpMs) {
        timed = Simulate(traffic, listenersOnly); // warm, as ours is
    }
    Write(traffic, argv[2]);
    std::cout << timed.setUpMs << ' ' << timed.runMs << ' ' << timed.events << '\n';
    return 0;
}
