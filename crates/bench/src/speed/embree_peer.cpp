// Embree as a peer: camera rays against a mesh, one by one and in packets of 8, on one thread, with robust intersection.
// usage: embree_peer MESH (float32 x 9 a triangle) CAMERA (12 doubles: eye, corner, right, up) SIDE ROUNDS
// prints: CPU seconds of the fastest round one by one, of the fastest in packets, number of hits of each

#include <embree3/rtcore.h>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <vector>

static double cpu() {
    timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

int main(int count, char** arguments) {
    if (count != 5) return 2;
    std::ifstream file(arguments[1], std::ios::binary | std::ios::ate);
    std::vector<float> corners(file.tellg() / sizeof(float));
    file.seekg(0);
    file.read(reinterpret_cast<char*>(corners.data()), corners.size() * sizeof(float));
    std::ifstream view(arguments[2]);
    double c[12];
    for (double& x : c) view >> x;
    const int side = std::atoi(arguments[3]), rounds = std::atoi(arguments[4]);

    RTCDevice device = rtcNewDevice("threads=1");
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    const size_t faces = corners.size() / 9;
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3 * faces));
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, faces));
    for (size_t k = 0; k < corners.size(); k++) vertices[k] = corners[k];
    for (size_t k = 0; k < 3 * faces; k++) indices[k] = unsigned(k);
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(scene, mesh);
    rtcCommitScene(scene);

    auto direction = [&](int i, int j, float* d) {
        double v[3], square = 0;
        for (int k = 0; k < 3; k++) {
            v[k] = c[3 + k] + i * c[6 + k] + j * c[9 + k];
            square += v[k] * v[k];
        }
        for (int k = 0; k < 3; k++) d[k] = float(v[k] / std::sqrt(square));
    };
    double single = 1e30, packets = 1e30;
    long single_hits = 0, packet_hits = 0;
    for (int round = 0; round < rounds; round++) {
        long hits = 0;
        double start = cpu();
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
        // Tiles of 4 x 2, in the order in which the packets go.
        for (int j = 0; j < side; j += 2)
            for (int i = 0; i < side; i += 4)
                for (int k = 0; k < 8; k++) {
                    RTCRayHit ray{};
                    float d[3];
                    direction(i + k % 4, j + k / 4, d);
                    ray.ray.org_x = float(c[0]), ray.ray.org_y = float(c[1]), ray.ray.org_z = float(c[2]);
                    ray.ray.dir_x = d[0], ray.ray.dir_y = d[1], ray.ray.dir_z = d[2];
                    ray.ray.tfar = INFINITY, ray.ray.mask = -1;
                    ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
                    rtcIntersect1(scene, &context, &ray);
                    hits += ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
                }
        double middle = cpu();
        single = std::fmin(single, middle - start), single_hits = hits, hits = 0;
        for (int j = 0; j < side; j += 2)
            for (int i = 0; i < side; i += 4) {
                alignas(32) RTCRayHit8 ray{};
                alignas(32) int valid[8];
                for (int k = 0; k < 8; k++) {
                    float d[3];
                    direction(i + k % 4, j + k / 4, d);
                    valid[k] = -1;
                    ray.ray.org_x[k] = float(c[0]), ray.ray.org_y[k] = float(c[1]), ray.ray.org_z[k] = float(c[2]);
                    ray.ray.dir_x[k] = d[0], ray.ray.dir_y[k] = d[1], ray.ray.dir_z[k] = d[2];
                    ray.ray.tfar[k] = INFINITY, ray.ray.mask[k] = -1;
                    ray.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
                }
                rtcIntersect8(valid, scene, &context, &ray);
                for (int k = 0; k < 8; k++) hits += ray.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
            }
        packets = std::fmin(packets, cpu() - middle), packet_hits = hits;
    }
    std::printf("%.9f %.9f %ld %ld\n", single, packets, single_hits, packet_hits);
    return 0;
}
