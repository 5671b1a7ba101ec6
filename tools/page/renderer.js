// What the page uses of the PlayCanvas engine, as the global `pc`.
export {
    AppBase,
    AppOptions,
    CameraComponentSystem,
    Color,
    Entity,
    FILLMODE_NONE,
    GSPLATDATA_LARGE,
    GSplatComponentSystem,
    GSplatData,
    GSplatResource,
    PIXELFORMAT_R32U,
    PIXELFORMAT_RGBA8,
    TONEMAP_NONE,
    Texture,
    WebglGraphicsDevice,
} from 'playcanvas';
