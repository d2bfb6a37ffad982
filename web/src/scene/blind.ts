import * as THREE from 'three';

/** What stands in for a renderer where the browser has no WebGL: nothing is drawn, everything else goes on. */
export function blindRenderer(canvas: HTMLCanvasElement): THREE.WebGLRenderer {
  const nothing = (): void => undefined;
  return {
    domElement: canvas,
    shadowMap: {},
    info: { render: {} },
    setAnimationLoop(act: ((time: number) => void) | null) {
      const step = (time: number): void => {
        act?.(time);
        requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    },
    setPixelRatio: nothing,
    setSize: nothing,
    render: nothing,
    xr: { isPresenting: false, setReferenceSpaceType: nothing, getControllerGrip: () => new THREE.Group() },
  } as unknown as THREE.WebGLRenderer;
}
