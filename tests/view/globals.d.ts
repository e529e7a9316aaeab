// What the pages find beside our modules; neither library of Debian's has types.
declare const THREE: any;
declare const Chart: any;
interface Window {
  players?: any[];
}
declare class DecompressionStream extends TransformStream<Uint8Array, Uint8Array> {
  constructor(format: string);
}
