// Random access in ns-3's UAN module: who pings when under UanMacAloha or UanMacCw, and who hears it.
//
// usage: ns3_access CASE
//
// CASE is text: "aloha" or "csma", AUVs, ASVs, HF range (m), sound speed (m/s), length of a ping (s),
// backoff slots to draw from, length of one (s), end (s); a line "x y z" (m) for each AUV, then each
// ASV; then a line "instant AUV" (s) for each ping that an AUV has to send.
// Prints "draw AUV SLOTS" for the backoffs that each AUV will draw, in order; "ping NUMBER AUV
// INSTANT" for each that is sent, and "heard NUMBER ASV".

#include <cmath>
#include <cstdint>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "ns3/core-module.h"
#include "ns3/mobility-module.h"
#include "ns3/network-module.h"
#include "ns3/uan-module.h"

using namespace ns3;

// A signal out of range is this much weaker (dB).
constexpr double kSilent = 1000.0;

// Any length will do: a ping carries nothing, its band is as fast as gives it its duration.
constexpr uint32_t kPingBytes = 20;

// Streams of the AUVs' backoffs, and how many of each one's draws are told.
constexpr int64_t kFirstStream = 1000;
constexpr int kDraws = 200;

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

// A channel that brings signals to those in range only: UanMacCw takes any other for a fault.
class InRange : public UanChannel {
  public:
    void TxPacket(Ptr<UanTransducer> source, Ptr<Packet> packet, double power,
                  UanTxMode mode) override {
        Ptr<MobilityModel> sender;
        for (const auto& [device, transducer] : m_devList) {
            if (transducer == source) {
                sender = device->GetNode()->GetObject<MobilityModel>();
            }
        }
        for (uint32_t i = 0; i < m_devList.size(); ++i) {
            const auto& [device, transducer] = m_devList[i];
            Ptr<MobilityModel> place = device->GetNode()->GetObject<MobilityModel>();
            if (transducer == source || m_prop->GetPathLossDb(sender, place, mode) >= kSilent) {
                continue;
            }
            Simulator::ScheduleWithContext(device->GetNode()->GetId(),
                                           m_prop->GetDelay(sender, place, mode), &InRange::Bring,
                                           this, i, packet->Copy(), power, mode);
        }
    }

  private:
    void Bring(uint32_t i, Ptr<Packet> packet, double power, UanTxMode mode) {
        SendUp(i, packet, power, mode, UanPdp::CreateImpulsePdp());
    }
};

std::map<uint64_t, uint32_t> numbers; // packet -> ping

void Sent(uint32_t auv, Ptr<const Packet> packet, double, UanTxMode) {
    const uint32_t number = numbers.size();
    numbers[packet->GetUid()] = number;
    std::cout << "ping " << number << ' ' << auv << ' ' << Simulator::Now().GetSeconds() << '\n';
}

void Heard(uint32_t asv, Ptr<const Packet> packet, double, UanTxMode) {
    std::cout << "heard " << numbers.at(packet->GetUid()) << ' ' << asv << '\n';
}

void Enqueue(Ptr<UanMac> mac) {
    UanHeaderCommon header;
    Ptr<Packet> packet = Create<Packet>(kPingBytes - header.GetSerializedSize());
    mac->Enqueue(packet, 0, Mac8Address::GetBroadcast());
}

int main(int argc, char* argv[]) {
    std::ifstream file(argc == 2 ? argv[1] : "");
    std::string access;
    uint32_t auvs = 0, asvs = 0, window = 0;
    double range = 0, soundSpeed = 0, ping = 0, slot = 0, end = 0;
    file >> access >> auvs >> asvs >> range >> soundSpeed >> ping >> window >> slot >> end;
    if (!file || (access != "aloha" && access != "csma")) {
        std::cerr << "usage: ns3_access CASE\n";
        return 2;
    }
    std::cout << std::setprecision(12);

    UanModesList modes;
    modes.AppendMode(UanTxModeFactory::CreateMode(
        UanTxMode::FSK, static_cast<uint32_t>(std::lround(8 * kPingBytes / ping)), 1000, 25000,
        10000, 2, "ping"));
    UanHelper helper;
    helper.SetPhy("ns3::UanPhyGen", "SupportedModes", UanModesListValue(modes));
    if (access == "aloha") {
        helper.SetMac("ns3::UanMacAloha");
    } else {
        helper.SetMac("ns3::UanMacCw", "CW", UintegerValue(window), "SlotTime",
                      TimeValue(Seconds(slot)));
    }
    NodeContainer nodes;
    nodes.Create(auvs + asvs);
    for (uint32_t node = 0; node < nodes.GetN(); ++node) {
        Vector place;
        file >> place.x >> place.y >> place.z;
        Ptr<ConstantPositionMobilityModel> mobility = CreateObject<ConstantPositionMobilityModel>();
        mobility->SetPosition(place);
        nodes.Get(node)->AggregateObject(mobility);
    }
    Ptr<InRange> channel = CreateObject<InRange>();
    channel->SetPropagationModel(CreateObject<RangeLimited>(range, soundSpeed));
    channel->SetNoiseModel(CreateObject<UanNoiseModelDefault>());
    NetDeviceContainer devices = helper.Install(nodes, channel);
    for (uint32_t node = 0; node < nodes.GetN(); ++node) {
        Ptr<UanNetDevice> device = DynamicCast<UanNetDevice>(devices.Get(node));
        if (node < auvs) {
            device->GetPhy()->TraceConnectWithoutContext("Tx", MakeBoundCallback(&Sent, node));
            device->GetMac()->AssignStreams(kFirstStream + node);
            Ptr<UniformRandomVariable> twin = CreateObject<UniformRandomVariable>();
            twin->SetStream(kFirstStream + node);
            for (int draw = 0; access == "csma" && draw < kDraws; ++draw) {
                std::cout << "draw " << node << ' '
                          << static_cast<uint32_t>(twin->GetValue(0, window)) << '\n';
            }
        } else {
            device->GetPhy()->TraceConnectWithoutContext(
                "RxOk", MakeBoundCallback(&Heard, node - auvs));
        }
    }
    uint32_t auv = 0;
    for (double at = 0; file >> at >> auv;) {
        Ptr<UanMac> mac = DynamicCast<UanNetDevice>(devices.Get(auv))->GetMac();
        Simulator::Schedule(Seconds(at), &Enqueue, mac);
    }
    Simulator::Stop(Seconds(end));
    Simulator::Run();
    Simulator::Destroy();
    return 0;
}
