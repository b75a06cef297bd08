// Path loss after Thorp and noise after Wenz as ns-3's UAN module has them, as CSV.
//
// usage: ns3_sonar
//
// What `python benchmarks/peers/ns3_sonar.py` writes to tests/reference/ns3_sonar.csv.

#include <cstdio>

#include "ns3/core-module.h"
#include "ns3/mobility-module.h"
#include "ns3/uan-module.h"

using namespace ns3;

int main() {
    // Below 0.4 kHz ns-3 takes another law than Thorp's.
    const double frequencies[] = {0.4, 1.0, 3.0, 10.0, 18.0, 25.0, 50.0, 100.0, 150.0};
    const double ranges[] = {1.0, 50.0, 100.0, 777.7, 3500.0};
    const double spreadings[] = {1.0, 1.5, 2.0};
    const double seas[][2] = {{0.0, 0.0}, {0.5, 5.0}, {1.0, 12.5}};

    Ptr<MobilityModel> here = CreateObject<ConstantPositionMobilityModel>();
    Ptr<MobilityModel> there = CreateObject<ConstantPositionMobilityModel>();
    here->SetPosition(Vector(0.0, 0.0, 0.0));
    std::printf("frequency_khz,range_m,spreading,shipping,wind_m_per_s,path_loss_db,noise_db\n");
    for (double frequency : frequencies) {
        const UanTxMode mode = UanTxModeFactory::CreateMode(
            UanTxMode::OTHER, 1000, 1000, static_cast<uint32_t>(frequency * 1e3), 1000, 2, "line");
        for (int k = 0; k < 3; ++k) {
            Ptr<UanPropModelThorp> loss = CreateObject<UanPropModelThorp>();
            loss->SetAttribute("SpreadCoef", DoubleValue(spreadings[k]));
            Ptr<UanNoiseModelDefault> sea = CreateObject<UanNoiseModelDefault>();
            sea->SetAttribute("Shipping", DoubleValue(seas[k][0]));
            sea->SetAttribute("Wind", DoubleValue(seas[k][1]));
            for (double range : ranges) {
                there->SetPosition(Vector(range, 0.0, 0.0));
                std::printf("%g,%g,%g,%g,%g,%.12f,%.12f\n", frequency, range, spreadings[k],
                            seas[k][0], seas[k][1], loss->GetPathLossDb(here, there, mode),
                            sea->GetNoiseDbHz(frequency));
            }
        }
    }
    return 0;
}
